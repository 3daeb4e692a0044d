//! Height maps: heights on a grid, their pyramid, and the surface between them.

use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::ground::Ground;
use super::noise::Place;
use super::real::Real;
use crate::error::Error;

/// What lies beyond the border of a height map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Edge {
    /// The map again.
    #[default]
    Repeat,
    /// The map mirrored, the texels at the border twice.
    Mirror,
    /// The heights of the border.
    Clamp,
}

impl Edge {
    /// The number that the modules know it by (`EDGE_..` of `veduta::terrain::relief`).
    pub fn number(self) -> i32 {
        match self {
            Edge::Repeat => 0,
            Edge::Mirror => 1,
            Edge::Clamp => 2,
        }
    }

    /// The texel of a row of `count` that stands for texel `i`.
    fn texel(self, i: i32, count: i32) -> i32 {
        match self {
            Edge::Repeat => i.rem_euclid(count),
            Edge::Mirror => {
                let r = i.rem_euclid(2 * count);
                r.min(2 * count - 1 - r)
            }
            Edge::Clamp => i.clamp(0, count - 1),
        }
    }
}

/// Texels of a map's side at most.
const MOST: usize = 16_384;

/// A grid of values, and the pyramids that were made of it.
#[derive(Debug)]
struct Grid {
    size: [i32; 2],
    values: Vec<f32>,
    /// The last few, by edge, scale, offset and width of a texel.
    pyramids: Mutex<Vec<([u64; 4], Arc<Pyramid>)>>,
}

/// The values of a height map. Copies share them.
#[derive(Debug, Clone)]
pub struct MapTexels {
    grid: Arc<Grid>,
}

impl PartialEq for MapTexels {
    fn eq(&self, other: &MapTexels) -> bool {
        Arc::ptr_eq(&self.grid, &other.grid)
            || (self.grid.size == other.grid.size && self.grid.values == other.grid.values)
    }
}

fn fault(name: &str, value: String, domain: &str) -> Error {
    Error::OutOfDomain {
        name: format!("map.{name}"),
        value,
        domain: domain.to_owned(),
    }
}

impl MapTexels {
    /// Values in rows of `width`, from the least z up, each row from the least x up.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for fewer than 2 or more than 16,384 texels a side, for values that are not a whole number of rows, and for one that is not finite.
    pub fn new(width: usize, values: Vec<f32>) -> Result<MapTexels, Error> {
        if !(2..=MOST).contains(&width) {
            return Err(fault("width", width.to_string(), "in [2, 16384]"));
        }
        let rows = values.len() / width;
        if rows * width != values.len() || !(2..=MOST).contains(&rows) {
            let value = format!("{} values in rows of {width}", values.len());
            return Err(fault("values", value, "2 to 16384 whole rows"));
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            let name = format!("values[{}][{}]", at / width, at % width);
            return Err(fault(&name, values[at].to_string(), "finite"));
        }
        Ok(MapTexels {
            grid: Arc::new(Grid {
                size: [width as i32, rows as i32],
                values,
                pyramids: Mutex::new(Vec::new()),
            }),
        })
    }

    /// The values of a host's texture of the format `R32Float` with the usage `COPY_SRC`. Submits and waits.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for another format; as [`MapTexels::new`]; [`Error::Device`].
    pub fn from_texture(
        gpu: &crate::device::Gpu,
        texture: &wgpu::Texture,
    ) -> Result<MapTexels, Error> {
        let format = texture.format();
        if format != wgpu::TextureFormat::R32Float
            || !texture.usage().contains(wgpu::TextureUsages::COPY_SRC)
        {
            let value = format!("{format:?}, {:?}", texture.usage());
            return Err(fault("texture", value, "R32Float with COPY_SRC"));
        }
        let bytes = gpu.read_texture(texture)?;
        let values = bytes
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        MapTexels::new(texture.width() as usize, values)
    }

    /// Texels along x and along z.
    pub fn size(&self) -> [usize; 2] {
        self.grid.size.map(|s| s as usize)
    }

    /// The values, row by row.
    pub fn values(&self) -> &[f32] {
        &self.grid.values
    }
}

fn one() -> f64 {
    1.0
}

/// A map of heights in the place of a field's coarse octaves. The field's wavelength is the width of a texel, on which the middle of the first texel lies at `origin`; its octaves are detail
/// that is added, from cells of that width down.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeightMap {
    /// The file that holds it: `.png` (grey; values from 0 to 1), `.exr` or `.npy`. Empty for one that a program makes.
    #[serde(default)]
    pub file: String,
    /// What lies beyond its border.
    #[serde(default)]
    pub edge: Edge,
    /// Place of the middle of the first texel (x, z) (m), finite and within 1e15.
    #[serde(default)]
    pub origin: [f64; 2],
    /// Height of a value of 0 (m), in [-2e4, 2e4].
    #[serde(default)]
    pub lowest: f64,
    /// Height of a value of 1 (m), in [-2e4, 2e4]. By default 1, for maps that hold metres.
    #[serde(default = "one")]
    pub highest: f64,
    /// Its values, once they have been read or made.
    #[serde(skip)]
    pub texels: Option<MapTexels>,
}

impl HeightMap {
    /// A map that holds metres, from a program.
    pub fn of(texels: MapTexels, edge: Edge) -> HeightMap {
        HeightMap {
            edge,
            highest: 1.0,
            texels: Some(texels),
            ..HeightMap::default()
        }
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        for (name, value) in [("lowest", self.lowest), ("highest", self.highest)] {
            if !(-2e4..=2e4).contains(&value) {
                return Err(fault(name, value.to_string(), "in [-2e4, 2e4] m"));
            }
        }
        match self.origin.iter().find(|o| o.abs() > 1e15 || o.is_nan()) {
            Some(o) => Err(fault("origin", o.to_string(), "in [-1e15, 1e15] m")),
            None => Ok(()),
        }
    }

    /// Its values, once they have been read or made.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a map without values.
    fn grid(&self) -> Result<&Grid, Error> {
        match &self.texels {
            Some(texels) => Ok(&texels.grid),
            None => {
                let value = format!("none, of the file `{}`", self.file);
                let domain = "read (HeightMap::read, Land::read) or given by the program";
                Err(fault("texels", value, domain))
            }
        }
    }

    /// Heights of `columns` x `rows` texels from the first on, by rows, beyond the border as its edge says (m).
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a map without values.
    pub(crate) fn heights(&self, columns: i32, rows: i32) -> Result<Vec<f64>, Error> {
        let Grid { size, values, .. } = self.grid()?;
        let scale = self.highest - self.lowest;
        let of = |x: i32, z: i32| {
            let at = self.edge.texel(z, size[1]) * size[0] + self.edge.texel(x, size[0]);
            self.lowest + scale * f64::from(values[at as usize])
        };
        Ok((0..rows)
            .flat_map(|z| (0..columns).map(move |x| (x, z)))
            .map(|(x, z)| of(x, z))
            .collect())
    }

    /// The pyramid for texels of a width (m).
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a map without values, and for heights beyond 2e4 m.
    pub(super) fn pyramid(&self, texel: f64) -> Result<Arc<Pyramid>, Error> {
        let grid = self.grid()?;
        let scale = self.highest - self.lowest;
        let key = [
            self.edge.number() as u64,
            self.lowest.to_bits(),
            scale.to_bits(),
            texel.to_bits(),
        ];
        let mut known = grid.pyramids.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, made)) = known.iter().find(|(k, _)| *k == key) {
            return Ok(Arc::clone(made));
        }
        let heights = |v: &f32| (self.lowest + scale * f64::from(*v)) as f32;
        let heights: Vec<f32> = grid.values.iter().map(heights).collect();
        if let Some(h) = heights.iter().find(|h| !(-2e4..=2e4).contains(*h)) {
            return Err(fault("height", h.to_string(), "in [-2e4, 2e4] m"));
        }
        let made = Arc::new(Pyramid::new(grid.size, &heights, self.edge, texel));
        if known.len() >= 4 {
            known.remove(0);
        }
        known.push((key, Arc::clone(&made)));
        Ok(made)
    }
}

/// One level of a pyramid.
#[derive(Debug, PartialEq)]
pub(super) struct Level {
    /// Texels along x and z.
    pub size: [i32; 2],
    /// Height (m), and mean square of the slopes of the whole map over the texel.
    pub texels: Vec<[f32; 2]>,
}

/// A map with its means over ever larger squares, each about twice as wide as the last.
#[derive(Debug, PartialEq)]
pub(super) struct Pyramid {
    pub edge: Edge,
    pub levels: Vec<Level>,
    /// Bounds of the surface through the texels of any level: least and greatest height (m), steepest slope.
    pub minimum: f64,
    pub maximum: f64,
    pub lipschitz: f64,
}

/// Which texels of a row of `from` a texel of the row of `to` covers, each with its share.
fn covered(i: i32, from: i32, to: i32) -> impl Iterator<Item = (i32, f64)> {
    // In units of 1 / `to` of a texel.
    let (begin, end) = (i * from, (i + 1) * from);
    (begin / to..(end + to - 1) / to).map(move |k| {
        let inside = (end.min((k + 1) * to) - begin.max(k * to)).max(0);
        (k, f64::from(inside) / f64::from(from))
    })
}

/// Means over the texels of a level half as fine.
fn halved(level: &Level) -> Level {
    let size = level.size.map(|s| (s / 2).max(1));
    let mut texels = Vec::with_capacity((size[0] * size[1]) as usize);
    for z in 0..size[1] {
        for x in 0..size[0] {
            let mut sum = [0.0_f64; 2];
            for (j, down) in covered(z, level.size[1], size[1]) {
                for (i, across) in covered(x, level.size[0], size[0]) {
                    let texel = level.texels[(j * level.size[0] + i) as usize];
                    for k in 0..2 {
                        sum[k] += down * across * f64::from(texel[k]);
                    }
                }
            }
            texels.push(sum.map(|s| s as f32));
        }
    }
    Level { size, texels }
}

/// Bezier's points of the piece of a cubic through four values, between the second and the third.
fn control([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [b, b + (c - a) / 6.0, c - (d - b) / 6.0, c]
}

impl Pyramid {
    fn new(size: [i32; 2], heights: &[f32], edge: Edge, texel: f64) -> Pyramid {
        let at = |x: i32, z: i32| {
            let [x, z] = [edge.texel(x, size[0]), edge.texel(z, size[1])];
            f64::from(heights[(z * size[0] + x) as usize])
        };
        let mut texels = Vec::with_capacity(heights.len());
        for z in 0..size[1] {
            for x in 0..size[0] {
                let slope = [at(x + 1, z) - at(x - 1, z), at(x, z + 1) - at(x, z - 1)]
                    .map(|rise| rise / (2.0 * texel));
                let square = slope[0] * slope[0] + slope[1] * slope[1];
                texels.push([at(x, z) as f32, square as f32]);
            }
        }
        let mut levels = vec![Level { size, texels }];
        while let Some(last) = levels.last().filter(|l| l.size != [1, 1]) {
            let next = halved(last);
            levels.push(next);
        }
        let mut pyramid = Pyramid {
            edge,
            levels,
            minimum: f64::INFINITY,
            maximum: f64::NEG_INFINITY,
            lipschitz: 0.0,
        };
        for level in 0..pyramid.levels.len() {
            pyramid.bound(level, texel);
        }
        // Rounding of heights and slopes in `f32`.
        let slack = 1e-5 * pyramid.minimum.abs().max(pyramid.maximum.abs());
        pyramid.minimum -= slack;
        pyramid.maximum += slack;
        pyramid.lipschitz = 1.0001 * pyramid.lipschitz + slack / texel;
        pyramid
    }

    /// Widens the bounds by a level's surface: no piece leaves the hull of its Bezier points, nor its slopes that of theirs.
    fn bound(&mut self, level: usize, texel: f64) {
        let whole = self.levels[0].size;
        let Level { size, texels } = &self.levels[level];
        let [width, depth] = [0, 1].map(|k| texel * f64::from(whole[k]) / f64::from(size[k]));
        let at = |x: i32, z: i32| {
            let [x, z] = [self.edge.texel(x, size[0]), self.edge.texel(z, size[1])];
            f64::from(texels[(z * size[0] + x) as usize][0])
        };
        // Rows of Bezier points along x, of four rows of texels at a time.
        let row = |x: i32, z: i32| control(std::array::from_fn(|k| at(x + k as i32 - 1, z)));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut steep = 0.0_f64;
        for x in -2..=size[0] {
            let mut rows: [[f64; 4]; 4] = std::array::from_fn(|k| row(x, k as i32 - 3));
            for z in -2..=size[1] {
                rows.rotate_left(1);
                rows[3] = row(x, z + 2);
                let columns: [[f64; 4]; 4] =
                    std::array::from_fn(|i| control(std::array::from_fn(|j| rows[j][i])));
                let mut slopes = [0.0_f64; 2];
                for i in 0..4 {
                    for j in 0..4 {
                        low = low.min(columns[i][j]);
                        high = high.max(columns[i][j]);
                        if i < 3 {
                            let rise = columns[i + 1][j] - columns[i][j];
                            slopes[0] = slopes[0].max(rise.abs() * 3.0 / width);
                        }
                        if j < 3 {
                            let rise = columns[i][j + 1] - columns[i][j];
                            slopes[1] = slopes[1].max(rise.abs() * 3.0 / depth);
                        }
                    }
                }
                steep = steep.max(slopes[0].hypot(slopes[1]));
            }
        }
        self.minimum = self.minimum.min(low);
        self.maximum = self.maximum.max(high);
        self.lipschitz = self.lipschitz.max(steep);
    }

    /// The cell that stands for one of a larger lattice, between plus and minus 2^30.
    pub fn reduced(&self, cell: i128, axis: usize) -> i128 {
        const MOST: i128 = 1 << 30;
        if cell.abs() <= MOST {
            return cell;
        }
        match self.edge {
            Edge::Clamp => cell.clamp(-MOST, MOST),
            _ => cell.rem_euclid(2 * i128::from(self.levels[0].size[axis])),
        }
    }
}

/// Catmull and Rom's cubic through four values, and its slope.
fn cubic<T: Real>([a, b, c, d]: [T; 4], t: T) -> [T; 2] {
    let [half, two, three, four, five] = [0.5, 2.0, 3.0, 4.0, 5.0].map(T::of);
    let first = c - a;
    let second = two * a - five * b + four * c - d;
    let third = three * (b - c) + d - a;
    [
        b + half * t * (first + t * (second + t * third)),
        half * (first + t * (two * second + three * t * third)),
    ]
}

impl Pyramid {
    /// Height, slopes along x and z, and mean square of the slopes, on one level.
    fn level_ground<T: Real>(&self, level: usize, place: Place<T>, texel: T) -> [T; 4] {
        let Level { size, texels } = &self.levels[level];
        let whole = self.levels[0].size;
        let mut first = [0; 2];
        let mut t = [T::of(0.0); 2];
        let mut inverse = t;
        for k in 0..2 {
            let (n, from) = (size[k], whole[k]);
            let cell = match self.edge {
                Edge::Clamp => place.cell[k].clamp(-4 * from, 5 * from),
                _ => place.cell[k].rem_euclid(2 * from),
            };
            let parts = cell * n;
            let (count, width) = (T::of(f64::from(n)), T::of(f64::from(from)));
            let x = (T::of(f64::from(parts.rem_euclid(from)))
                + (place.frac[k] + T::of(0.5)) * count)
                / width
                - T::of(0.5);
            let below = x.whole();
            t[k] = x - below;
            first[k] = parts.div_euclid(from) + below.wide() as i32;
            inverse[k] = count / (width * texel);
        }
        let texel_at = |i: i32, j: i32| {
            let x = self.edge.texel(first[0] + i - 1, size[0]);
            let z = self.edge.texel(first[1] + j - 1, size[1]);
            texels[(z * size[0] + x) as usize].map(|v| T::of(f64::from(v)))
        };
        let rows: [[T; 2]; 4] = std::array::from_fn(|j| {
            cubic(
                std::array::from_fn(|i| texel_at(i as i32, j as i32)[0]),
                t[0],
            )
        });
        let [height, along_z] = cubic(rows.map(|r| r[0]), t[1]);
        let [along_x, _] = cubic(rows.map(|r| r[1]), t[1]);
        let square = |i: i32, j: i32| texel_at(i, j)[1];
        let low = square(1, 1) + t[0] * (square(2, 1) - square(1, 1));
        let high = square(1, 2) + t[0] * (square(2, 2) - square(1, 2));
        [
            height,
            inverse[0] * along_x,
            inverse[1] * along_z,
            low + t[1] * (high - low),
        ]
    }

    /// The map at a place on the lattice of its texels, filtered by a footprint.
    pub fn ground<T: Real>(&self, place: Place<T>, texel: T, footprint: T) -> Ground<T> {
        let [zero, one, two] = [0.0, 1.0, 2.0].map(T::of);
        let mut ratio = (T::of(std::f64::consts::FRAC_1_SQRT_2) * footprint / texel).most(one);
        let last = self.levels.len() - 1;
        let mut level = 0;
        while ratio >= two && level < 30 {
            ratio *= T::of(0.5);
            level += 1;
        }
        let x = two / ratio - one;
        let keep = if level >= last {
            one
        } else {
            x * x * (T::of(3.0) - two * x)
        };
        let level = level.min(last);
        let fine = self.level_ground(level, place, texel);
        let coarse = self.level_ground((level + 1).min(last), place, texel);
        let mixed: [T; 4] = std::array::from_fn(|k| keep * fine[k] + (one - keep) * coarse[k]);
        let left = if level == 0 { one - keep } else { one };
        let slope = [mixed[1], mixed[2]];
        Ground {
            height: mixed[0],
            slope,
            lost: left * (mixed[3] - (slope[0] * slope[0] + slope[1] * slope[1])).most(zero),
        }
    }
}

/// A pyramid on the device; a single texel for fields without a map.
#[derive(Debug)]
pub(super) struct Relief {
    pub view: wgpu::TextureView,
    texture: wgpu::Texture,
    /// What has yet to be uploaded.
    pending: Option<Arc<Pyramid>>,
    bytes: u64,
}

impl Relief {
    /// Makes room for the map of a field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a map that is larger than the device's textures may be.
    pub fn new(device: &wgpu::Device, map: Option<Arc<Pyramid>>) -> Result<Relief, Error> {
        let [width, height] = map.as_ref().map_or([1; 2], |m| m.levels[0].size);
        let most = device.limits().max_texture_dimension_2d;
        if width.max(height).cast_unsigned() > most {
            let value = format!("{width}x{height}");
            return Err(fault(
                "size",
                value,
                &format!("at most {most} on this device"),
            ));
        }
        let levels = map.as_ref().map_or(1, |m| m.levels.len());
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("veduta height map"),
            size: wgpu::Extent3d {
                width: width.cast_unsigned(),
                height: height.cast_unsigned(),
                depth_or_array_layers: 1,
            },
            mip_level_count: levels as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rg32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let texels = map.as_ref().map_or(1, |m| {
            m.levels.iter().map(|l| l.texels.len()).sum::<usize>()
        });
        Ok(Relief {
            view: texture.create_view(&Default::default()),
            texture,
            pending: map,
            bytes: 8 * texels as u64,
        })
    }

    /// What it keeps on the device.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Uploads the map, the first time: how often was written, and how many bytes.
    pub fn upload(&mut self, queue: &wgpu::Queue) -> (u32, u64) {
        let Some(map) = self.pending.take() else {
            return (0, 0);
        };
        for (level, part) in (0..).zip(&map.levels) {
            let [width, height] = part.size.map(i32::cast_unsigned);
            let bytes: Vec<u8> = part
                .texels
                .iter()
                .flatten()
                .flat_map(|v| v.to_le_bytes())
                .collect();
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    mip_level: level,
                    ..self.texture.as_image_copy()
                },
                &bytes,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(8 * width),
                    rows_per_image: None,
                },
                wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
            );
        }
        (map.levels.len() as u32, self.bytes)
    }
}
