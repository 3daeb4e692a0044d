//! How far found hits are from where rays meet the field.

use super::land::Land;
use super::rays::{TerrainHit, TerrainRay};
use crate::error::Error;
use crate::reference::parallel::parallel_map;

/// Errors of the hits of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct HitErrors {
    /// Rays.
    pub rays: usize,
    /// Rays of which one answer is a hit and the other is not, with the silhouette more than a pixel away.
    pub wrong: usize,
    /// The same within a pixel of the silhouette.
    pub at_silhouette: usize,
    /// Rays that ran out of steps.
    pub capped: usize,
    /// Errors of the rays that both answers say hit, in ascending order: distances from the field along its normal, over the footprint at the true hit (the angle of a pixel times its distance, at
    /// least 5 cm). Of a ray that ends too early it is how far its end is from the ground; of one that ends too late how deep it has been below it, the deepest of 65 places between the two hits.
    pub across: Vec<f64>,
}

impl HitErrors {
    /// The error that a share of the hits does not exceed; 0 without hits.
    pub fn centile(&self, share: f64) -> f64 {
        let place = self.across.len().saturating_sub(1) as f64 * share.clamp(0.0, 1.0);
        self.across.get(place as usize).copied().unwrap_or(0.0)
    }
}

/// Judges what was found for the rays of a picture with so many columns by bracketing in `f64`. Footprints grow by `pixel_angle` (rad).
///
/// # Errors
/// As [`Land::check`] and [`TerrainRay::check`]; [`Error::OutOfDomain`] when rays and hits are not equally many and a multiple of the columns.
pub fn hit_errors(
    land: &Land,
    rays: &[TerrainRay],
    columns: usize,
    pixel_angle: f64,
    found: &[TerrainHit],
) -> Result<HitErrors, Error> {
    land.check()?;
    if columns == 0 || !rays.len().is_multiple_of(columns) || found.len() != rays.len() {
        return Err(Error::OutOfDomain {
            name: "hits and columns".to_owned(),
            value: format!("{} and {columns}", found.len()),
            domain: format!("one hit for each of {} rays, in whole rows", rays.len()),
        });
    }
    let field = land.prepare::<f64>()?;
    let truth: Vec<TerrainHit> = parallel_map(rays.len(), |i| {
        field.ray_hit(land.planet_radius, &rays[i], pixel_angle, 0.05)
    })
    .into_iter()
    .collect::<Result<_, _>>()?;
    let rows = rays.len() / columns;
    let met = |i: usize| truth[i].distance.is_finite();
    // A pixel is next to the silhouette when one of its neighbours sees the other side of it.
    let near_edge = |i: usize| {
        let (x, y) = (i % columns, i / columns);
        (y.saturating_sub(1)..(y + 2).min(rows)).any(|v| {
            (x.saturating_sub(1)..(x + 2).min(columns)).any(|u| met(v * columns + u) != met(i))
        })
    };
    let mut errors = HitErrors {
        rays: rays.len(),
        wrong: 0,
        at_silhouette: 0,
        capped: 0,
        across: Vec::new(),
    };
    for (i, (f, t)) in found.iter().zip(&truth).enumerate() {
        errors.capped += usize::from(f.capped);
        match (f.distance.is_finite(), t.distance.is_finite()) {
            (true, true) => {
                let (near, far) = (f.distance.min(t.distance), f.distance.max(t.distance));
                let eye = field.place(rays[i].origin);
                let radius = land.planet_radius + rays[i].origin.altitude();
                let gap = |at: f64| {
                    let [x, y, z] = rays[i].dir.map(|c| c * at);
                    let altitude =
                        (x * x + (y + radius).powi(2) + z * z).sqrt() - land.planet_radius;
                    let g = field.ground_from(eye, [x, z], pixel_angle * at);
                    (altitude - g.height) * g.normal()[1]
                };
                let across = if f.distance < t.distance {
                    gap(near)
                } else {
                    (0..=64)
                        .map(|k| -gap(near + (far - near) * f64::from(k) / 64.0))
                        .fold(0.0, f64::max)
                };
                let footprint = (pixel_angle * t.distance).max(0.05);
                errors.across.push(across.abs() / footprint);
            }
            (false, false) => {}
            _ if near_edge(i) => errors.at_silhouette += 1,
            _ => errors.wrong += 1,
        }
    }
    errors.across.sort_by(f64::total_cmp);
    Ok(errors)
}
