Light of a cloud layer alone along given rays, for a sun of irradiance 1 without air: by marching its noise and to the sun from every sample, or from
its tile.

#PROGRAM{ cloud_probe }#

#COMPUTE{
    #CODE{
#ifdef CLOUD_SHADOW
#import veduta::clouds::tile::{CloudTile, cloud_shadow}
#else
#import veduta::lighting::phase::{phase_double_henyey_greenstein}
#import veduta::planet::shell::{ground_distance, direction_cosine_along, altitude_along}
#ifdef CLOUD_TILE
#import veduta::clouds::tile::{CloudTile, march_tile}
#else
#import veduta::planet::shell::{shell_segment, clip_segment, segment_length, segment_distance}
#import veduta::clouds::integral::{step_light}
#ifdef CLOUD_SHAPED
#import veduta::clouds::field::{CloudLayer}
#import veduta::clouds::march::{layer_exit}
#ifdef CLOUD_MAPPED
#import veduta::clouds::shape::{CloudShape, mapped_density}
#else
#import veduta::clouds::shape::{CloudShape, shaped_density}
#endif
#else
#import veduta::clouds::field::{CloudLayer, cloud_density}
#import veduta::clouds::march::{sun_depth}
#endif
#endif
#endif

struct LayerProbe {
    to_sun: vec3<f32>,
    ground_radius: f32,
    shear: vec2<f32>,
    sunward: vec2<f32>,
    edge: f32,
    levels: f32,
    bottom: f32,
    thickness: f32,
    extinction: f32,
    albedo: f32,
    g_forward: f32,
    g_backward: f32,
    backward_share: f32,
    coverage: f32,
    uniformity: f32,
    turns_per_metre: f32,
    period_doublings: u32,
    seed: u32,
    count: i32,
    // Of clouds with forms.
    kind: f32,
    kind_spread: f32,
    coverage_spread: f32,
    detail: f32,
    sharpness: f32,
    weather_doublings: u32,
    // The least density that the tile tells.
    least: f32,
    // Times that a map for the weather lies along the edge.
    repeats: u32,
}

struct LayerRay {
    dir: vec3<f32>,
    altitude: f32,
    distance: f32,
}

struct LayerLight {
    scatter: f32,
    transmittance: f32,
}

@group(0) @binding(0) var<uniform> probe: LayerProbe;
@group(1) @binding(0) var<storage, read> rays: array<LayerRay>;
#ifdef CLOUD_SHADOW
@group(1) @binding(1) var linear: sampler;
@group(1) @binding(2) var tile: texture_3d<f32>;
#else
#ifdef CLOUD_TILE
@group(1) @binding(1) var linear: sampler;
@group(1) @binding(2) var tile: texture_3d<f32>;
#endif
#endif
#ifdef CLOUD_MAPPED
@group(1) @binding(3) var weather: texture_2d<f32>;
#endif
@group(2) @binding(0) var<storage, read_write> results: array<LayerLight>;

#ifndef CLOUD_SHADOW
#ifndef CLOUD_TILE
fn density_here(layer: CloudLayer, relative: vec3<f32>, altitude: f32) -> f32 {
#ifdef CLOUD_SHAPED
    let shape = CloudShape(probe.kind, probe.kind_spread, probe.coverage_spread, probe.detail, probe.sharpness, probe.weather_doublings);
#ifdef CLOUD_MAPPED
    return clamp(mapped_density(weather, layer, shape, probe.repeats, relative, altitude), 0.0, 1.0);
#else
    return clamp(shaped_density(layer, shape, relative, altitude), 0.0, 1.0);
#endif
#else
    return cloud_density(layer, relative, altitude);
#endif
}

// Depth to the sun; infinite behind the planet.
fn light_depth(layer: CloudLayer, altitude: f32, dir: vec3<f32>, t: f32, along: f32) -> f32 {
    let nu = dot(dir, probe.to_sun);
    let at = clamp(along, layer.bottom, layer.bottom + layer.thickness);
    let mu = direction_cosine_along(probe.ground_radius, altitude, at, probe.to_sun.y, nu, t);
#ifdef CLOUD_SHAPED
    let ds = layer_exit(layer, probe.ground_radius, at, mu) / 48.0;
    var sum = 0.0;
    // Two at once: software devices end all loops after 65,535 rounds.
    for (var i = 0; i < 24; i++) {
        let s = (f32(2 * i) + 0.5) * ds;
        let u = s + ds;
        sum += density_here(layer, dir * t + probe.to_sun * s, altitude_along(probe.ground_radius, at, mu, s))
            + density_here(layer, dir * t + probe.to_sun * u, altitude_along(probe.ground_radius, at, mu, u));
    }
    let depth = sum * ds * layer.extinction;
#else
    let depth = sun_depth(layer, probe.ground_radius, dir * t, at, probe.to_sun, mu, 48);
#endif
    return select(depth, 1e3, ground_distance(probe.ground_radius, at, mu) >= 0.0);
}
#endif
#endif

@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if i32(id.x) >= probe.count {
        return;
    }
    let ray = rays[id.x];
    let dir = ray.dir;
#ifdef CLOUD_SHADOW
    // A point across instead of a direction.
    let shade = CloudTile(vec2<f32>(0.0), probe.shear, probe.sunward, 1.0 / probe.edge, probe.bottom, probe.thickness, probe.levels, probe.extinction, 0.0, probe.least);
    results[id.x] = LayerLight(0.0, cloud_shadow(tile, linear, shade, dir.xz, ray.altitude));
#else
    let ground = ground_distance(probe.ground_radius, ray.altitude, dir.y);
    let far = select(ray.distance, min(ray.distance, ground), ground >= 0.0);
    let nu = dot(dir, probe.to_sun);
    let phase = probe.albedo * phase_double_henyey_greenstein(nu, probe.g_forward, probe.g_backward, probe.backward_share);
#ifdef CLOUD_TILE
    let layer = CloudTile(vec2<f32>(0.0), probe.shear, probe.sunward, 1.0 / probe.edge, probe.bottom, probe.thickness, probe.levels, probe.extinction, 0.0, probe.least);
    let light = march_tile(tile, linear, layer, probe.ground_radius, ray.altitude, dir, far, 1e-6, 2048, 0.0);
    let at = altitude_along(probe.ground_radius, ray.altitude, dir.y, light.mean_distance);
    let mu = direction_cosine_along(probe.ground_radius, ray.altitude, at, probe.to_sun.y, nu, light.mean_distance);
    let lit = ground_distance(probe.ground_radius, at, mu) < 0.0;
    results[id.x] = LayerLight(select(0.0, phase * light.scatter, lit), light.transmittance);
#else
    let layer = CloudLayer(vec3<u32>(0u), probe.turns_per_metre, probe.period_doublings, 0.5, probe.bottom, probe.thickness, probe.coverage, probe.uniformity,
        probe.extinction, probe.albedo, probe.g_forward, probe.g_backward, probe.backward_share, probe.seed);
    let segment = clip_segment(shell_segment(probe.ground_radius, probe.bottom, probe.bottom + probe.thickness, ray.altitude, dir.y), far);
    let size = segment_length(segment);
    let longest = max(size / 900.0, 15.0);
    var s = 0.0;
    var depth = 0.0;
    var scatter = 0.0;
    var density = 0.0;
    var sun = 0.0;
    var known = false;
    if size > 0.0 {
        let t = segment_distance(segment, 0.0);
        density = density_here(layer, dir * t, clamp(altitude_along(probe.ground_radius, ray.altitude, dir.y, t), probe.bottom, probe.bottom + probe.thickness));
    }
    for (var i = 0; i < 1250 && s < size && depth < 14.0; i++) {
        let ds = min(clamp(0.5 / max(density * probe.extinction, 1e-9), 0.2 * longest, longest), size - s + 0.01);
        let t = segment_distance(segment, s);
        let u = segment_distance(segment, s + ds);
        let along = clamp(altitude_along(probe.ground_radius, ray.altitude, dir.y, u), probe.bottom, probe.bottom + probe.thickness);
        let next = density_here(layer, dir * u, along);
        let added = 0.5 * (density + next) * probe.extinction * ds;
        // A march only where there is cloud: both sides of a branch take their loops.
        if added > 0.0 {
            if !known {
                sun = light_depth(layer, ray.altitude, dir, t, altitude_along(probe.ground_radius, ray.altitude, dir.y, t));
            }
            let next_sun = light_depth(layer, ray.altitude, dir, u, along);
            scatter += exp(-depth) * step_light(added, sun, next_sun);
            sun = next_sun;
        }
        known = added > 0.0;
        depth += added;
        density = next;
        s += ds;
    }
    results[id.x] = LayerLight(phase * scatter, exp(-depth));
#endif
#endif
}
    }#
}#
