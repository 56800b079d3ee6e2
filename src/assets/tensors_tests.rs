//! Tensor files: what is read, and what is refused.

use super::*;

/// A file of fields: name, type, shape and bytes.
fn file(fields: &[(&str, u8, &[u64], Vec<u8>)]) -> Vec<u8> {
    let header: usize = fields.iter().map(|(name, _, shape, _)| 13 + name.len() + 8 * shape.len()).sum();
    let mut bytes = [TENSOR_MAGIC.as_slice(), &VERSION, &(fields.len() as u32).to_le_bytes()].concat();
    let mut offset = (bytes.len() + header) as u64;
    for (name, kind, shape, data) in fields {
        bytes.extend((name.len() as u16).to_le_bytes());
        bytes.extend(name.bytes());
        bytes.extend((shape.len() as u16).to_le_bytes());
        bytes.push(*kind);
        bytes.extend(std::iter::once(&offset).chain(*shape).flat_map(|size| size.to_le_bytes()));
        offset += data.len() as u64;
    }
    bytes.extend(fields.iter().flat_map(|(.., data)| data));
    bytes
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

type Fields = Vec<(&'static str, u8, &'static [u64], Vec<u8>)>;

/// A file of one azimuth and two angles from the normal.
fn small() -> Fields {
    let ramp = |count: u8| floats(&(0..count).map(f32::from).collect::<Vec<_>>());
    vec![
        ("phi_i", FLOAT32, &[1], floats(&[0.5])),
        ("theta_i", FLOAT32, &[2], floats(&[0.0, 1.5])),
        ("ndf", FLOAT32, &[2, 3], ramp(6)),
        ("sigma", FLOAT32, &[2, 2], ramp(4)),
        ("vndf", FLOAT32, &[1, 2, 3, 2], ramp(12)),
        ("luminance", FLOAT32, &[1, 2, 2, 2], ramp(8)),
        ("rgb", FLOAT32, &[1, 2, 3, 2, 2], ramp(24)),
        ("jacobian", UINT8, &[1], vec![1]),
        ("something else", 77, &[9; 3], vec![]),
    ]
}

/// The same with other fields in place of those of a name.
fn with(name: &str, fields: Fields) -> Fields {
    small().into_iter().filter(|field| field.0 != name).chain(fields).collect()
}

#[track_caller]
fn refused(fields: &Fields, expected: &str) {
    let error = parse(&file(fields)).unwrap_err();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn all_fields_are_read() {
    let data = parse(&file(&small())).unwrap();
    assert_eq!((data.phi, data.theta, data.jacobian), (vec![0.5], vec![0.0, 1.5], true));
    assert_eq!((data.ndf.size, data.sigma.size, data.vndf.size), ([3, 2], [2, 2], [2, 3]));
    assert_eq!(data.vndf.values[11], 11.0);
    // Red, green and blue are slices of the file.
    assert_eq!(data.colors.values[..2], [[0.0, 4.0, 8.0], [1.0, 5.0, 9.0]]);
    assert_eq!(data.colors.values[4..6], [[12.0, 16.0, 20.0], [13.0, 17.0, 21.0]]);
}

#[test]
fn spectra_are_colours_under_daylight() {
    let wavelengths = [350.0, 450.0, 550.0, 650.0, 900.0];
    let read = |spectra: &[[f32; 5]; 4]| {
        let (by_pixel, mut values) = (spectra, Vec::new());
        for _ in 0..2 {
            values.extend((0..5).flat_map(|k| by_pixel.iter().map(move |spectrum| spectrum[k])));
        }
        let fields = vec![
            ("wavelengths", FLOAT32, &[5][..], floats(&wavelengths)),
            ("spectra", FLOAT32, &[1, 2, 5, 2, 2], floats(&values)),
        ];
        parse(&file(&with("rgb", fields))).unwrap().colors.values
    };
    let spectra = [[0.25; 5], [0.1, 0.3, 0.8, 0.2, 0.9], [0.0, 0.0, 0.0, 1.0, 1.0], [0.0; 5]];
    let colors = read(&spectra);
    for (color, spectrum) in colors.iter().zip(spectra.iter().cycle()) {
        let samples = wavelengths.iter().zip(spectrum).map(|(&w, &v)| [f64::from(w), f64::from(v)]).collect();
        let expected = Spectrum::samples(samples).unwrap().reflectance();
        let is_close = color.iter().zip(expected).all(|(c, e)| (c - e.max(0.0)).abs() < 1e-5);
        assert!(is_close, "{spectrum:?}: {color:?}, {expected:?}");
    }
    assert_eq!(colors.len(), 8);
    assert!(colors[0].iter().all(|c| (c - 0.25).abs() < 1e-5), "{colors:?}");
    assert!(colors[2][0] > 0.8 && colors[2][2] == 0.0, "{colors:?}");
}

#[test]
fn truncated_files_are_refused() {
    let mut fields = small();
    fields.pop();
    let good = file(&fields);
    assert!(parse(&good).is_ok());
    for length in 0..good.len() {
        assert!(parse(&good[..length]).is_err(), "{length}");
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    assert!(parse(b"tensor_fil").unwrap_err().contains("no tensor file"));
    let mut later = file(&small());
    later[12] = 2;
    assert!(parse(&later).unwrap_err().contains("version 2.0"));
    let field = |name, kind, shape, values: &[f32]| with(name, vec![(name, kind, shape, floats(values))]);
    refused(&with("ndf", vec![]), "no field `ndf`");
    refused(&with("rgb", vec![]), "no field `wavelengths`");
    refused(&field("ndf", 11, &[2, 2], &[1.0; 4]), "numbers of type 11");
    refused(&field("ndf", FLOAT32, &[4], &[1.0; 4]), "no rows and columns");
    refused(&field("ndf", FLOAT32, &[1, 4], &[1.0; 4]), "at least 2");
    refused(&field("ndf", FLOAT32, &[2, 2], &[1.0, 2.0, f32::NAN, 0.0]), "value NaN");
    refused(&field("ndf", FLOAT32, &[2, 2], &[1.0, 2.0, 1e10, 0.0]), "more than 1e9");
    refused(&field("ndf", FLOAT32, &[1 << 40, 1 << 40], &[]), "beyond the end");
    refused(&field("ndf", FLOAT32, &[1 << 30, 1 << 30], &[]), "beyond the end");
    refused(&field("vndf", FLOAT32, &[2, 2, 2, 2], &[1.0; 16]), "must begin with [1, 2]");
    refused(&field("theta_i", FLOAT32, &[2], &[1.0, 1.0]), "must increase");
    refused(&field("theta_i", FLOAT32, &[2], &[0.0, 2.0]), "from 0 to 1.57");
    refused(&field("theta_i", FLOAT32, &[0], &[]), "from 1 to 4096 numbers");
    refused(&field("phi_i", FLOAT32, &[2, 1], &[0.0, 1.0]), "from 1 to 4096 numbers");
    refused(&field("jacobian", UINT8, &[1 << 63], &[]), "beyond the end");
    let mut fields = small();
    fields[0] = ("phi_i", FLOAT32, &[4096], floats(&(0..4096u16).map(|i| f32::from(i) / 4096.0).collect::<Vec<_>>()));
    refused(&fields, "more than 4096");
}

#[test]
fn azimuths_cover_a_part_of_the_circle_that_others_reflect() {
    let third = |last: f32| {
        let mut fields = small();
        fields[0] = ("phi_i", FLOAT32, &[3], floats(&[-PI, -3.0, last]));
        let many = |shape: &[u64]| floats(&vec![1.0; shape.iter().product::<u64>() as usize]);
        for (i, shape) in [(4, &[3, 2, 3, 2][..]), (5, &[3, 2, 2, 2]), (6, &[3, 2, 3, 2, 2])] {
            fields[i] = (fields[i].0, FLOAT32, shape, many(shape));
        }
        parse(&file(&fields))
    };
    assert!([-0.5 * PI, 0.0, PI].into_iter().all(|last| third(last).is_ok()));
    assert!(third(1.0).unwrap_err().contains("whole circle, half or a quarter"));
}
