//! Colour spaces: linear RGB (Rec.709), an opponent space in which vision is blurred, and L*a*b* with the Hunt effect.

/// One value by pixel.
pub type Plane = Vec<f32>;

/// A picture as three planes.
#[derive(Clone, Debug)]
pub struct Planes {
    /// Width and height.
    pub size: [usize; 2],
    pub planes: [Plane; 3],
}

/// XYZ of linear RGB, with D65 as white (from the primaries and the white point of IEC 61966-2-1, in exact fractions).
const TO_XYZ: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// The inverse.
const FROM_XYZ: [[f64; 3]; 3] = [
    [3.241_003_275, -1.537_398_934, -0.498_615_861],
    [-0.969_224_334, 1.875_930_071, 0.041_554_224],
    [0.055_639_423, -0.204_011_202, 1.057_148_933],
];

/// Where L*a*b* turns from a straight line to a cube root.
const CORNER: f32 = 6.0 / 29.0;

impl Planes {
    pub fn len(&self) -> usize {
        self.planes[0].len()
    }

    #[inline]
    pub fn pixel(&self, i: usize) -> [f32; 3] {
        [self.planes[0][i], self.planes[1][i], self.planes[2][i]]
    }

    /// The same function for every value.
    pub fn map(&self, of: impl Fn(f32) -> f32) -> Self {
        let plane = |plane: &Plane| plane.iter().map(|x| of(*x)).collect();
        Self { size: self.size, planes: [plane(&self.planes[0]), plane(&self.planes[1]), plane(&self.planes[2])] }
    }

    fn map_pixels(&self, of: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        let mut out = self.clone();
        for i in 0..self.len() {
            let [a, b, c] = of(self.pixel(i));
            (out.planes[0][i], out.planes[1][i], out.planes[2][i]) = (a, b, c);
        }
        out
    }

    /// From linear RGB to lightness, red against green, yellow against blue (YCxCz), all linear.
    pub fn to_opponent(&self) -> Self {
        self.map_pixels(|rgb| {
            let [x, y, z] = relative_xyz(rgb);
            [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
        })
    }

    /// Back to linear RGB, limited to what a screen can show.
    pub fn to_screen(&self) -> Self {
        self.map_pixels(|[lightness, red, yellow]| {
            let y = (lightness + 16.0) / 116.0;
            let white = white();
            let xyz = [(y + red / 500.0) * white[0], y * white[1], (y - yellow / 200.0) * white[2]];
            multiply(&FROM_XYZ, xyz).map(|x| x.clamp(0.0, 1.0))
        })
    }
}

/// How different two linear colours look: the HyAB distance in L*a*b*, in which dark colours are less colourful (Hunt).
pub fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [a, b] = [hunt_lab(a), hunt_lab(b)];
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    let root = |x: f32| if x > CORNER * CORNER * CORNER { x.cbrt() } else { x / (3.0 * CORNER * CORNER) + 4.0 / 29.0 };
    let [x, y, z] = relative_xyz(rgb).map(root);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// XYZ over that of white.
fn relative_xyz(rgb: [f32; 3]) -> [f32; 3] {
    let (xyz, white) = (multiply(&TO_XYZ, rgb), white());
    [xyz[0] / white[0], xyz[1] / white[1], xyz[2] / white[2]]
}

/// XYZ of white: that of red, green and blue together.
fn white() -> [f32; 3] {
    TO_XYZ.map(|row| row.iter().sum::<f64>() as f32)
}

fn multiply(matrix: &[[f64; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] as f32 * v[0] + row[1] as f32 * v[1] + row[2] as f32 * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_there_and_back_is_the_identity() {
        let picture = Planes { size: [2, 1], planes: [vec![0.2, 1.0], vec![0.5, 0.0], vec![0.9, 0.3]] };
        let back = picture.to_opponent().to_screen();
        for i in 0..2 {
            assert!(picture.pixel(i).iter().zip(back.pixel(i)).all(|(a, b)| (a - b).abs() < 1e-5), "{back:?}");
        }
    }

    #[test]
    fn white_and_black_are_a_hundred_apart_and_grey_has_no_colour() {
        assert!((distance([1.0; 3], [0.0; 3]) - 100.0).abs() < 1e-3);
        let [lightness, a, b] = hunt_lab([0.184_186_5; 3]);
        assert!((lightness - 50.0).abs() < 1e-2 && a.abs() < 1e-3 && b.abs() < 1e-3);
    }
}
