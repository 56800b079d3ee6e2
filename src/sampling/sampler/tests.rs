use super::*;

#[test]
fn sobols_first_dimensions_are_the_tabulated_ones() {
    // The first eight points of the sequence in Joe and Kuo's table, in eighths.
    let directions = sobol_directions();
    let point = |index: usize, dimension: usize| {
        let bits = (0..3).filter(|bit| index >> bit & 1 == 1).fold(0, |sum, bit| sum ^ directions[dimension][bit]);
        bits >> 29
    };
    let expected =
        [[0, 4, 2, 6, 1, 5, 3, 7], [0, 4, 6, 2, 5, 1, 3, 7], [0, 4, 6, 2, 3, 7, 5, 1], [0, 4, 6, 2, 1, 5, 7, 3]];
    for (dimension, row) in expected.into_iter().enumerate() {
        let column: Vec<_> = (0..8).map(|index| point(index, dimension)).collect();
        assert_eq!(column, row);
    }
}
