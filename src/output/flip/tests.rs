use super::*;

const SIZE: [u32; 2] = [48, 32];

fn picture(size: [u32; 2], value: impl Fn(u32, u32) -> [f32; 3]) -> Image {
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let data = pixels.flat_map(|(x, y)| value(x, y).into_iter().chain([1.0])).collect();
    Image::of_color(size, data)
}

fn reference(x: u32, y: u32) -> [f32; 3] {
    let [fx, fy] = [x, y].map(f64::from);
    let blob = 4.0 * (-((fx - 24.0).powi(2) + (fy - 16.0).powi(2)) / 50.0).exp();
    [0.5 + 0.5 * (0.3 * fx + 0.2 * fy).sin(), blob, 0.1 + 0.02 * fx].map(|v| v as f32)
}

fn test(x: u32, y: u32) -> [f32; 3] {
    let [r, g, b] = reference(x, y);
    let more = if (5..9).contains(&x) && (5..9).contains(&y) { 2.0 } else { 0.0 };
    [r * 1.1, g + (0.3 * f64::from((x * 7 + y * 13) % 5) / 4.0) as f32, b + more]
}

/// Expected values are those of the authors' program (PyPI's flip-evaluator 1.7).
#[test]
fn a_pair_of_bright_pictures_differs_as_the_authors_say() {
    let (a, b) = (picture(SIZE, reference), picture(SIZE, test));
    let map = hdr_flip(&a, &b).unwrap();
    assert!((mean(&map) - 0.737_110_8).abs() < 2e-4, "{}", mean(&map));
    for ([x, y], expected) in [([0, 0], 0.933_104), ([7, 7], 0.966_328), ([24, 16], 0.084_108), ([47, 31], 0.968_131)] {
        let found = map[y * 48 + x];
        assert!((found - expected).abs() < 1e-3, "{x} {y}: {found} {expected}");
    }
    // The exposures are those of the reference, so that the order matters a little.
    assert!((mean(&hdr_flip(&b, &a).unwrap()) - 0.735_690_2).abs() < 2e-4);
    let found = exposures(&planes(&a).unwrap());
    assert!(
        found.len() == 4 && (found[0] + 0.463_154).abs() < 1e-4 && (found[3] - 3.244_490).abs() < 1e-4,
        "{found:?}"
    );
    // A median of black is as far as it goes.
    let dark = picture(SIZE, |x, y| if y < 20 { [0.0; 3] } else { reference(x, y) });
    assert!((mean(&hdr_flip(&dark, &b).unwrap()) - 0.924_697_2).abs() < 2e-4);
}

#[test]
fn what_a_screen_shows_differs_as_the_authors_say_in_either_order() {
    let clamp =
        |of: fn(u32, u32) -> [f32; 3]| planes(&picture(SIZE, |x, y| of(x, y).map(|v| v.clamp(0.0, 1.0)))).unwrap();
    let (a, b) = (clamp(reference), clamp(test));
    let there = difference(&a, &b);
    assert!((mean(&there) - 0.496_322_2).abs() < 2e-4, "{}", mean(&there));
    assert!((there[7 * 48 + 7] - 0.622_487).abs() < 1e-3);
    assert_eq!(there, difference(&b, &a));
}

#[test]
fn equal_pictures_do_not_differ_and_extremes_do_fully() {
    let a = picture(SIZE, reference);
    assert!(hdr_flip(&a, &a).unwrap().iter().all(|d| *d == 0.0));
    let one = |color: [f32; 3]| planes(&picture([8, 8], |_, _| color)).unwrap();
    let full = difference(&one([0.0, 1.0, 0.0]), &one([0.0, 0.0, 1.0]));
    assert!(full.iter().all(|d| (d - 1.0).abs() < 1e-3), "{full:?}");
    let black = picture(SIZE, |_, _| [0.0; 3]);
    assert_eq!(mean(&hdr_flip(&black, &a).unwrap()), 0.0);
}

#[test]
fn odd_input_is_no_panic() {
    let a = picture([5, 1], |x, _| [x as f32; 3]);
    let b = picture([5, 1], |x, _| [[f32::NAN, f32::INFINITY, -3.0, 1e30, 0.0][x as usize]; 3]);
    assert!(hdr_flip(&a, &b).unwrap().iter().all(|d| (0.0..=1.01).contains(d)));
    assert!(hdr_flip(&a, &picture([4, 1], |_, _| [0.0; 3])).is_err());
}

#[test]
fn the_tone_mapper_is_inverted() {
    assert!((tone_map(1.0, inverse_tone(SHOWN) as f32) - 0.85).abs() < 1e-5);
}
