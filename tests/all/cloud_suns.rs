//! Layers of clouds under low suns: the tile's depths to the sun against those along the ray on the round planet.

use crate::common::{Random, gpu};
use veduta::clouds::{CloudDeck, layer_shadow};
use veduta::reference::clouds as exact;
use veduta::reference::{parallel::parallel_map, planet};
use veduta::view::direction;

/// Share of the sun's light that comes straight to points within a layer.
fn along_rays(deck: &CloudDeck, to_sun: [f64; 3], points: &[[f64; 3]]) -> Vec<f64> {
    let layer = exact::CloudLayer::of(deck);
    let radius = deck.planet_radius;
    let shape = deck.shape.as_ref().map(|s| exact::CloudShape {
        kind: s.kind,
        kind_spread: s.kind_spread,
        coverage_spread: s.coverage_spread,
        detail: s.detail,
        sharpness: s.sharpness,
        weather_doublings: s.weather_doublings,
    });
    parallel_map(points.len(), |k| {
        let [x, altitude, z] = points[k];
        let mu = to_sun[1];
        let far = exact::layer_exit(&layer, radius, altitude, mu);
        let count = (far * 40.0 / deck.wavelength).ceil() as i32;
        let Some(shape) = &shape else {
            let depth = exact::sun_depth(&layer, radius, [x, 0.0, z], altitude, to_sun, mu, count);
            return (-depth).exp();
        };
        let ds = far / f64::from(count);
        let (mut depth, mut i) = (0.0, 0);
        // What is dark stays dark.
        while i < count && depth < 12.0 {
            let s = (f64::from(i) + 0.5) * ds;
            let at = [x + s * to_sun[0], 0.0, z + s * to_sun[2]];
            let up = planet::altitude_along(radius, altitude, mu, s);
            let top = deck.bottom + deck.thickness;
            let density = exact::shaped_density(&layer, shape, at, up.clamp(deck.bottom, top));
            depth += density.clamp(0.0, 1.0) * ds * deck.extinction;
            i += 1;
        }
        (-depth).exp()
    })
}

/// Judges `cloud_shadow` and the bake of tiles under suns from 15 down to 1 degree.
#[test]
fn depths_under_low_suns_meet_the_reference() {
    for (name, count, bounds) in [
        ("thesis", 300, [0.01, 0.025, 0.035, 0.04, 0.03]),
        ("fair", 60, [0.05, 0.09, 0.08, 0.12, 0.15]),
        ("towers", 60, [0.09, 0.06, 0.07, 0.14, 0.15]),
    ] {
        let deck = CloudDeck::named(name).unwrap();
        let mut random = Random(11);
        let period = deck.period();
        let points: Vec<[f64; 3]> = (0..count)
            .map(|_| {
                let [x, y, z] = [0; 3].map(|_| f64::from(random.unit()));
                [x * period, deck.bottom + y * deck.thickness, z * period]
            })
            .collect();
        for (height, bound) in [15.0_f64, 7.0, 4.0, 2.0, 1.0].into_iter().zip(bounds) {
            let sun = |height: f64| direction(height, 0.6).to_array();
            let wanted = along_rays(&deck, sun(height.to_radians()), &points);
            let off = |height: f64| {
                let found =
                    layer_shadow(gpu(), veduta::programs(), &deck, sun(height), &points).unwrap();
                let pairs = || found.iter().map(|f| f64::from(*f)).zip(&wanted);
                let square: f64 = pairs().map(|(f, w)| (f - w).powi(2)).sum();
                let mean: f64 = pairs().map(|(f, _)| f).sum();
                let count = points.len() as f64;
                ((square / count).sqrt(), mean / count)
            };
            let (rms, mean) = off(height.to_radians());
            let truth = wanted.iter().sum::<f64>() / points.len() as f64;
            println!(
                "{name} {height} degrees: off by {rms:.3} RMS, mean {mean:.3}, {truth:.3} along the rays"
            );
            assert!(rms < bound, "{name} {height}: {rms}");
            assert!((mean - truth).abs() < 0.03);
            if height == 4.0 {
                // The lowest sun that columns follow does not stand for it.
                let (followed, _) = off(f64::from(deck.lowest_sun(64)).asin());
                println!("{name}: {followed:.3} with columns along the sun");
                assert!(rms < 0.3 * followed, "{name} {followed}");
            }
        }
    }
}
