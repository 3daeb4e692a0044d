//! Height maps from files: PNG, OpenEXR and NPY.

use std::path::Path;

use super::land::Land;
use super::map::{HeightMap, MapTexels};
use crate::error::Error;
use crate::map_file::{Channels, decode};

impl HeightMap {
    /// Reads the map's file, which is looked for in a folder. PNG: grey, 8 or 16 bits a pixel, as values from 0 to 1; OpenEXR: the only channel, or the one called Y, Z or
    /// height; NPY: an array of rows, `f4`, `f8`, `u1`, `u2`, `i2` or `i4`. Rows come from the least z (north) up.
    ///
    /// # Errors
    /// [`Error::HeightMap`] with the file and what is wrong with it.
    pub fn read(&mut self, folder: &Path) -> Result<(), Error> {
        let path = folder.join(&self.file);
        let fault = |what: String| Error::HeightMap {
            file: path.display().to_string(),
            what,
        };
        let (width, values) = decode(&path, &Channels::HEIGHT).map_err(fault)?;
        self.texels = Some(MapTexels::new(width, values).map_err(|e| fault(e.to_string()))?);
        Ok(())
    }
}

impl Land {
    /// Reads a land's file, and that of its height map, which is looked for beside it.
    ///
    /// # Errors
    /// [`Error::Ron`] with the file's path, for one that cannot be read too; as [`Land::from_ron`] and [`HeightMap::read`].
    pub fn read(path: &Path) -> Result<Land, Error> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| Error::Ron(format!("no land: {}: {e}", path.display())))?;
        let mut land = Land::from_ron(&text)?;
        if let Some(map) = &mut land.field.map {
            map.read(path.parent().unwrap_or(Path::new("")))?;
        }
        Ok(land)
    }
}
