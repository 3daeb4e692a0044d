//! The state of a ground as numbers on the host.

use crate::error::Error;

/// Channels of a cell: ground base, water, sediment, mean water, outflow speeds to +x, +z, -x, -z, change of the ground, what rounding took from the change, from the
/// water and from the sediment, discharge to +x and +z (`Physical`; else 0). Metres, metres a second, square metres a second.
pub const CHANNELS: usize = 14;

const NAMES: [&str; CHANNELS] = [
    "ground base",
    "water",
    "sediment",
    "mean water",
    "speed to +x",
    "speed to +z",
    "speed to -x",
    "speed to -z",
    "ground change",
    "lost of change",
    "lost of water",
    "lost of sediment",
    "discharge to +x",
    "discharge to +z",
];

/// Bounds of each channel.
const BOUNDS: [(f32, f32); CHANNELS] = [
    (-1e5, 1e5),
    (0.0, 1e5),
    (-1e-6, 1e5),
    (0.0, 1e5),
    (0.0, 1e5),
    (0.0, 1e5),
    (0.0, 1e5),
    (0.0, 1e5),
    (-1e5, 1e5),
    (-1.0, 1.0),
    (-1.0, 1.0),
    (-1.0, 1.0),
    (-1e9, 1e9),
    (-1e9, 1e9),
];

/// Every cell's channels.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundState {
    /// Cells along x, in [16, 4096].
    pub columns: usize,
    /// Cells along z, in [16, 4096].
    pub rows: usize,
    /// [`CHANNELS`] numbers a cell, cells by rows.
    pub cells: Vec<f32>,
    /// Whether discharges were given; else, and where all of them are 0, they follow from speeds: a state of `Source` has none.
    pub has_discharges: bool,
}

impl GroundState {
    /// Dry ground of given heights (m), by rows.
    ///
    /// # Errors
    /// As [`GroundState::from_channels`].
    pub fn from_heights(
        columns: usize,
        rows: usize,
        heights: &[f32],
    ) -> Result<GroundState, Error> {
        let data: Vec<f32> = heights
            .iter()
            .flat_map(|h| [*h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
            .collect();
        GroundState::from_channels(columns, rows, 8, &data)
    }

    /// Cells of 8 to [`CHANNELS`] channels; those left out are 0.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for sizes, numbers of channels, and numbers out of bounds or not finite, with the place.
    pub fn from_channels(
        columns: usize,
        rows: usize,
        channels: usize,
        data: &[f32],
    ) -> Result<GroundState, Error> {
        let bad = |name: &str, value: String, domain: &str| {
            Err(Error::OutOfDomain {
                name: name.to_owned(),
                value,
                domain: domain.to_owned(),
            })
        };
        for (name, size) in [("columns", columns), ("rows", rows)] {
            if !(16..=4096).contains(&size) {
                return bad(&format!("ground.{name}"), size.to_string(), "in [16, 4096]");
            }
        }
        if !(8..=CHANNELS).contains(&channels) {
            return bad("ground.channels", channels.to_string(), "in [8, 14]");
        }
        if data.len() != columns * rows * channels {
            return bad(
                "ground.cells",
                format!("{} numbers", data.len()),
                &format!("{} numbers", columns * rows * channels),
            );
        }
        let mut cells = vec![0.0; columns * rows * CHANNELS];
        for (at, (to, from)) in cells
            .chunks_exact_mut(CHANNELS)
            .zip(data.chunks_exact(channels))
            .enumerate()
        {
            for (k, value) in from.iter().enumerate() {
                let (low, high) = BOUNDS[k];
                if !(low..=high).contains(value) {
                    return bad(
                        &format!(
                            "{} of row {}, column {}",
                            NAMES[k],
                            at / columns,
                            at % columns
                        ),
                        value.to_string(),
                        &format!("in [{low}, {high}]"),
                    );
                }
                to[k] = *value;
            }
        }
        Ok(GroundState {
            columns,
            rows,
            cells,
            has_discharges: channels == CHANNELS,
        })
    }

    /// The channels of the cell at a column and row.
    ///
    /// # Panics
    /// When the row is not below `rows`, or the cell lies beyond the end of `cells`. A column beyond `columns` is one of a later row.
    pub fn cell(&self, x: usize, z: usize) -> &[f32] {
        let at = (z * self.columns + x) * CHANNELS;
        &self.cells[at..at + CHANNELS]
    }

    /// The channels of the cell at a column and row, to change.
    ///
    /// # Panics
    /// As [`GroundState::cell`].
    pub fn cell_mut(&mut self, x: usize, z: usize) -> &mut [f32] {
        let at = (z * self.columns + x) * CHANNELS;
        &mut self.cells[at..at + CHANNELS]
    }

    /// Height of the ground (m).
    ///
    /// # Panics
    /// As [`GroundState::cell`].
    pub fn ground(&self, x: usize, z: usize) -> f64 {
        let c = self.cell(x, z);
        f64::from(c[0]) + f64::from(c[8]) + f64::from(c[9])
    }

    /// Depth of the water (m).
    ///
    /// # Panics
    /// As [`GroundState::cell`].
    pub fn water(&self, x: usize, z: usize) -> f64 {
        let c = self.cell(x, z);
        f64::from(c[1]) + f64::from(c[10])
    }

    /// Sums over all cells (m): ground, water, sediment.
    pub fn sums(&self) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for c in self.cells.chunks_exact(CHANNELS) {
            let c: Vec<f64> = c.iter().map(|v| f64::from(*v)).collect();
            sums[0] += c[0] + c[8] + c[9];
            sums[1] += c[1] + c[10];
            sums[2] += c[2] + c[11];
        }
        sums
    }

    /// Sum of the grounds' changes from their bases (m), and of their magnitudes.
    pub fn changes(&self) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for c in self.cells.chunks_exact(CHANNELS) {
            let change = f64::from(c[8]) + f64::from(c[9]);
            sums[0] += change;
            sums[1] += change.abs();
        }
        sums
    }
}
