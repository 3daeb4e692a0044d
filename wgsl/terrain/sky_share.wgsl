//! How much of the sky's light arrives on the ground between the heights around it.
//! source   Bavoil2008 (horizons by sectors); the integral over a sector and the levels: ours
//! symbols  tangent of the elevation of a horizon · g slope of the ground along a sector
#define_import_path veduta::terrain::sky_share

#import veduta::terrain::clipmap::{Clip, baked_height, level_of}

/// Irradiance of a uniform sky over the baked ground, as a share of what a plane of the zenith cosine of the ground's normal has when that is all that counts (`normal.y`). In each sector the
/// horizon is the highest of six heights, each 2.5 times as far as the one before it and from a level twice as fine as its distance, the ground's own plane, and the level.
///
/// domain  at in [-1e5, 1e5] m lin
/// domain  altitude in [-1e4, 1e4] m lin
/// domain  slope in [-10, 10] 1 lin
/// domain  footprint in [1e-3, 1e4] m log
/// domain  sectors in [0, 16] 1 lin
/// range   [0, 6] 1
/// error   0.3 abs of reference::terrain::sky_share
/// outside undefined
/// source  Bavoil2008; departs: exact for a uniform sky over the horizons
fn sky_share(heights: texture_2d_array<f32>, wrapping: sampler, places: texture_2d<f32>, clip: Clip, at: vec2<f32>, altitude: f32, slope: vec2<f32>, footprint: f32, sectors: i32) -> f32 {
    var sum = 0.0;
    let first = max(4.0 * footprint, 2.0 * clip.spacing);
    for (var i = 0; i < sectors; i++) {
        let turn = 6.283185307 * (f32(i) + 0.5) / f32(sectors);
        let dir = vec2<f32>(cos(turn), sin(turn));
        let g = dot(slope, dir);
        // No sky is below the level.
        var tangent = max(g, 0.0);
        var t = first;
        for (var k = 0; k < 6; k++) {
            let least = max((bitcast<i32>(0.5 * t / clip.spacing) >> 23u) - 127, 0);
            let there = at + dir * t;
            let rise = (baked_height(heights, wrapping, places, clip, there, least) - altitude) / t;
            // Beyond the coarsest level nothing is baked.
            tangent = select(tangent, max(tangent, rise), level_of(clip, there) < clip.levels);
            t *= 2.5;
        }
        let square = 1.0 / (1.0 + tangent * tangent);
        sum += square - g * (1.570796327 - atan(tangent) - tangent * square);
    }
    return select(1.0, max(sum, 0.0) / f32(max(sectors, 1)), sectors > 0);
}
