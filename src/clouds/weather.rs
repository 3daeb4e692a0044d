//! Weather over the land that a map tells: coverage and kind of a layer with forms.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::fault;
use crate::error::Error;

/// Texels of a map's side at most.
const MOST: usize = 4096;

/// Coverage and kind on a grid, which repeats. Copies share them.
#[derive(Debug, Clone)]
pub struct WeatherTexels {
    width: usize,
    values: Arc<[[f32; 2]]>,
}

impl PartialEq for WeatherTexels {
    fn eq(&self, other: &WeatherTexels) -> bool {
        self.width == other.width
            && (Arc::ptr_eq(&self.values, &other.values) || self.values == other.values)
    }
}

impl WeatherTexels {
    /// Coverage and kind, each in [0, 1], in rows of `width` from the least z up, each row from the least x up.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for less than 1 and more than 4096 texels a side, values that are not a whole number of rows, and one that is not in [0, 1].
    pub fn new(width: usize, values: Vec<[f32; 2]>) -> Result<WeatherTexels, Error> {
        if !(1..=MOST).contains(&width) {
            return Err(fault("weather.width", width, "in [1, 4096]"));
        }
        let rows = values.len() / width;
        if rows * width != values.len() || !(1..=MOST).contains(&rows) {
            let value = format!("{} texels in rows of {width}", values.len());
            return Err(fault("weather.values", value, "1 to 4096 whole rows"));
        }
        for (k, texel) in values.iter().enumerate() {
            for (value, name) in texel.iter().zip(["coverage", "kind"]) {
                if !(0.0..=1.0).contains(value) {
                    let name = format!("weather.values[{}][{}].{name}", k / width, k % width);
                    return Err(fault(&name, value, "in [0, 1]"));
                }
            }
        }
        Ok(WeatherTexels {
            width,
            values: values.into(),
        })
    }

    /// Texels along x and z.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.values.len() / self.width]
    }

    /// Coverage and kind by rows.
    pub fn values(&self) -> &[[f32; 2]] {
        &self.values
    }

    /// Coverage and kind at a place (x, z) in widths and heights of the map, whose first texel's corner lies at 0: linear between the middles of texels, beyond the border the map again.
    pub fn at(&self, place: [f64; 2]) -> [f64; 2] {
        let size = self.size();
        let axis = |k: usize| {
            let n = size[k] as f64;
            let at = (place[k] - place[k].floor()) * n - 0.5;
            let low = (at.floor() as i64).rem_euclid(size[k] as i64) as usize;
            (low, (low + 1) % size[k], at - at.floor())
        };
        let [(x0, x1, fx), (z0, z1, fz)] = [axis(0), axis(1)];
        std::array::from_fn(|c| {
            let texel = |x: usize, z: usize| f64::from(self.values[z * self.width + x][c]);
            let row = |z: usize| texel(x0, z) + (texel(x1, z) - texel(x0, z)) * fx;
            row(z0) + (row(z1) - row(z0)) * fz
        })
    }

    /// Greatest change of coverage and kind between neighbours, in texels of a map that is so wide and deep (1/m).
    fn slopes(&self, extent: f64) -> [f64; 2] {
        let [width, rows] = self.size();
        let mut most = [0.0_f64; 2];
        for (k, texel) in self.values.iter().enumerate() {
            let (x, z) = (k % width, k / width);
            let right = self.values[z * width + (x + 1) % width];
            let below = self.values[(z + 1) % rows * width + x];
            for c in 0..2 {
                let change = |other: [f32; 2], n: usize| {
                    f64::from((other[c] - texel[c]).abs()) * n as f64 / extent
                };
                most[c] = most[c].max(change(right, width)).max(change(below, rows));
            }
        }
        most
    }

    /// Bytes of its texture.
    pub(super) fn bytes(&self) -> u64 {
        8 * self.values.len() as u64
    }

    /// A texture for it.
    pub(super) fn texture(&self, device: &wgpu::Device) -> wgpu::Texture {
        let [width, height] = self.size().map(|n| n as u32);
        device.create_texture(&wgpu::TextureDescriptor {
            label: Some("veduta weather"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rg32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })
    }

    /// Fills its texture.
    pub(super) fn upload(&self, queue: &wgpu::Queue, texture: &wgpu::Texture) {
        let numbers = self.values.iter().flatten();
        let bytes: Vec<u8> = numbers.flat_map(|v| v.to_le_bytes()).collect();
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(8 * self.width as u32),
            rows_per_image: None,
        };
        queue.write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
    }
}

/// The weather of a layer with forms as a map tells it, in the place of noise: the map's coverage times that of the layer, the map's kind times that of the layer. It repeats, and goes
/// with the wind as the clouds do.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WeatherMap {
    /// The file that holds it: `.png` (8 or 16 bits; red and green, or grey and alpha), `.exr` (channels `coverage` and `kind`, or R and G) or `.npy` (rows, columns, 2). Empty for one
    /// that a program makes.
    pub file: String,
    /// Edge of the square of land that it lies on (m), the period of the layer or a whole part of it down to a 4096th; the period when none is given.
    pub extent: Option<f64>,
    /// Its values, once they have been read or made.
    #[serde(skip)]
    pub texels: Option<WeatherTexels>,
}

impl WeatherMap {
    /// A map over the layer's period, from a program.
    pub fn of(texels: WeatherTexels) -> WeatherMap {
        WeatherMap {
            texels: Some(texels),
            ..WeatherMap::default()
        }
    }

    /// Reads the map's file, which is looked for in a folder, with the feature `height_maps`. Rows come from the least z (north) up.
    ///
    /// # Errors
    /// [`Error::WeatherMap`] with the file and what is wrong with it.
    pub fn read(&mut self, folder: &Path) -> Result<(), Error> {
        let path = folder.join(&self.file);
        let fault = |what: String| Error::WeatherMap {
            file: path.display().to_string(),
            what,
        };
        #[cfg(feature = "height_maps")]
        let found = crate::map_file::decode(&path, &crate::map_file::Channels::WEATHER);
        #[cfg(not(feature = "height_maps"))]
        let found: Result<(usize, Vec<f32>), String> =
            Err("reading it needs the feature `height_maps`".to_owned());
        let (width, values) = found.map_err(fault)?;
        let values = values.as_chunks::<2>().0.to_vec();
        self.texels = Some(WeatherTexels::new(width, values).map_err(|e| fault(e.to_string()))?);
        Ok(())
    }

    /// Times that it lies along an edge of the period (m).
    pub(crate) fn repeats(&self, period: f64) -> u32 {
        self.extent.map_or(1, |e| (period / e).round() as u32)
    }

    pub(super) fn check(&self, period: f64) -> Result<(), Error> {
        if let Some(extent) = self.extent {
            let times = period / extent;
            if !(1.0 - 1e-6..=4096.5).contains(&times)
                || (times - times.round()).abs() > 1e-6 * times
            {
                return Err(fault(
                    "deck.shape.map.extent",
                    extent,
                    &format!("the period, {period} m, or a whole part of it"),
                ));
            }
        }
        Ok(())
    }

    /// Its values.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a map that has not been read.
    pub(super) fn known(&self) -> Result<&WeatherTexels, Error> {
        self.texels.as_ref().ok_or_else(|| {
            let value = format!("none, of the file `{}`", self.file);
            let domain = "read (CloudDeck::read, WeatherMap::read) or given by the program";
            fault("deck.shape.map.texels", value, domain)
        })
    }

    /// Greatest slopes of coverage and kind (1/m), for a period.
    pub(super) fn slopes(&self, period: f64) -> [f64; 2] {
        let extent = period / f64::from(self.repeats(period).max(1));
        self.texels.as_ref().map_or([0.0; 2], |t| t.slopes(extent))
    }
}
