//! Where weighted samples are summed: pixels with a border that shared samples reach.

/// The entries of a tile: its pixels in square cells, each with a border of entries for pixels of other cells that its
/// samples reach. All samples of a cell's pixels are as many. Without a border, there is one cell, and its entries are
/// the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cells {
    /// Width of the tile in pixels.
    width: u32,
    /// Cells in a row, and rows of cells.
    count: [u32; 2],
    /// Width and height of a cell in pixels, without the border.
    size: [u32; 2],
    border: u32,
}

impl Cells {
    /// Of a tile of this width and height.
    pub fn new(tile: [u32; 2], cell_size: u32, border: u32) -> Self {
        let size = tile.map(|side| side.min(cell_size));
        Self { width: tile[0], count: [tile[0].div_ceil(size[0]), tile[1].div_ceil(size[1])], size, border }
    }

    /// Number of entries.
    pub fn entries(&self) -> usize {
        (self.count[0] * self.count[1]) as usize * self.entries_of_cell()
    }

    /// Number of entries of one cell.
    pub fn entries_of_cell(&self) -> usize {
        self.stride() * (self.size[1] + 2 * self.border) as usize
    }

    /// Entries from one row of a cell to the next.
    #[inline]
    pub fn stride(&self) -> usize {
        (self.size[0] + 2 * self.border) as usize
    }

    /// The cell of a pixel, which is counted row by row within the tile.
    pub fn cell_of(&self, pixel: usize) -> usize {
        let (x, y) = (pixel as u32 % self.width, pixel as u32 / self.width);
        (y / self.size[1] * self.count[0] + x / self.size[0]) as usize
    }

    /// The entry of a pixel in its own cell.
    #[inline]
    pub fn entry_of(&self, pixel: usize) -> usize {
        if self.border == 0 {
            return pixel;
        }
        self.cell_of(pixel) * self.entries_of_cell() + self.entry_within_cell(pixel)
    }

    /// The entry of a pixel in its own cell, counted from the cell's first.
    #[inline]
    pub fn entry_within_cell(&self, pixel: usize) -> usize {
        let (x, y) = (pixel as u32 % self.width, pixel as u32 / self.width);
        let row = (y % self.size[1] + self.border) as usize;
        row * self.stride() + (x % self.size[0] + self.border) as usize
    }

    /// The entry of the pixel at this place of the tile in the cell of this column and row, whose border reaches it.
    #[inline]
    pub fn entry_in(&self, cell: [u32; 2], [x, y]: [i32; 2]) -> usize {
        let [column, row] = [(cell[0], self.size[0], x), (cell[1], self.size[1], y)]
            .map(|(cell, size, at)| (at - (cell * size) as i32 + self.border as i32) as usize);
        (cell[1] * self.count[0] + cell[0]) as usize * self.entries_of_cell() + row * self.stride() + column
    }
}
