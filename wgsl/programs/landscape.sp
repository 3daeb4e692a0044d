The whole picture in one fragment program: terrain, sky with aerial perspective, clouds, tone map (Leitner 2022,
figure 4.1). It draws one triangle that covers the target, reads two parameter blocks and no texture. This is the
textbook path: the picture that everything faster is compared with.

The eye stands still; the lattice cells of `Anchors` move with the world instead, so precision never depends on how
far the eye has travelled.

#PROGRAM{ landscape }#

#DEFINE{
    #VARYING{
struct Corner {
    @builtin(position) position: vec4<f32>,
    // Clip coordinates: -1 to 1 from left to right and from bottom to top.
    @location(0) clip: vec2<f32>,
}
    }#
}#

#VERTEX{
    #USE{ VARYING }#
    #CODE{
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let clip = vec2<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    return Corner(vec4<f32>(clip, 0.0, 1.0), clip);
}
    }#
}#

#FRAGMENT{
    #CODE{
#import veduta::tone_map::exponential::{exponential}
#import veduta::post::srgb::{encode_srgb, decode_srgb}
#import veduta::post::dither::{dither}
#import veduta::planet::shell::{ground_distance, up_at}
#import veduta::terrain::shading::{ThreeLights, shade_three_lights}
#ifdef ATMOSPHERE
#import veduta::atmosphere::march::{Atmosphere, march_sky, sun_transmittance}
#import veduta::atmosphere::sun_disc::{sun_disc}
#endif
#ifdef TERRAIN
#import veduta::fractal::fbm::{fbm_3d}
#import veduta::terrain::height::{Terrain}
#import veduta::planet::shell::{altitude_of}
#import veduta::terrain::march::{march}
#import veduta::terrain::normal::{terrain_normal}
#import veduta::terrain::shadow::{soft_shadow}
#import veduta::terrain::material::{Rock, snow_blend}
#ifdef TEXTURE_FILTERING
#import veduta::terrain::material::{surface_footprint}
#ifdef TEXTURE_LOW_QUALITY
#import veduta::terrain::material::{rock_low_filtered}
#else
#import veduta::terrain::material::{rock_high_filtered}
#endif
#else
#ifdef TEXTURE_LOW_QUALITY
#import veduta::terrain::material::{rock_low}
#else
#import veduta::terrain::material::{rock_high}
#endif
#endif
#endif
#ifdef CLOUDS
#ifndef LOW_QUALITY
#import veduta::planet::shell::{shell_segment, clip_segment, segment_length, direction_cosine_along}
#import veduta::clouds::field::{CloudLayer}
#ifdef ATMOSPHERE
#import veduta::clouds::composite::{composite_clouds}
#endif
#ifdef CLOUD_SKIP
#import veduta::clouds::march::{march_clouds_skip}
#else
#import veduta::clouds::march::{march_clouds}
#endif
#ifdef CLOUD_JITTER
#import veduta::hash::pcg::{pcg_2d, unit_float}
#endif
#endif
#endif
    }#
    #USE{ VARYING }#
    #CODE{
struct View {
    ray_middle: vec3<f32>,
    eye_altitude: f32,
    ray_right: vec3<f32>,
    exposure: f32,
    ray_up: vec3<f32>,
    sun_angular_radius: f32,
    to_sun: vec3<f32>,
    frame: u32,
    sun_irradiance: vec3<f32>,
    jitter: vec2<f32>,
}

// Every member is the content key of the same name. What a feature alone reads stands under its flag; where all are on,
// vectors are followed by numbers that fill their fourth place.
struct Content {
    sun_light: vec3<f32>,
    planet_radius: f32,
    sky_light: vec3<f32>,
#ifdef TERRAIN
    terrain_height: f32,
#endif
    bounce_light: vec3<f32>,
#ifdef TERRAIN
    terrain_scale: f32,
#endif
    rock_dark: vec3<f32>,
#ifdef TERRAIN
    terrain_hurst: f32,
    rock_light: vec3<f32>,
    terrain_gain: f32,
    snow_albedo: vec3<f32>,
    ridge_smoothness: f32,
#endif
#ifdef ATMOSPHERE
    rayleigh_scattering: vec3<f32>,
    rayleigh_height: f32,
#endif
#ifdef TERRAIN
    terrain_seed: u32,
    shadow_softness: f32,
    rock_scale: f32,
    snow_edge_low: f32,
    snow_edge_high: f32,
    snow_noise: f32,
#endif
#ifdef ATMOSPHERE
    atmosphere_height: f32,
    mie_scattering: f32,
    mie_extinction: f32,
    mie_height: f32,
    mie_g: f32,
#endif
#ifdef CLOUDS
#ifndef LOW_QUALITY
    clouds_height: f32,
    clouds_thickness: f32,
    cloud_coverage: f32,
    cloud_scale: f32,
    cloud_period_doublings: u32,
    cloud_density: f32,
    cloud_scattering: f32,
    cloud_absorption: f32,
    cloud_g_forward: f32,
    cloud_g_backward: f32,
    cloud_backward_share: f32,
    cloud_seed: u32,
#endif
#endif
}

@group(0) @binding(0) var<uniform> view: View;
@group(1) @binding(0) var<uniform> content: Content;

// Where the eye's foot point lies on each lattice that there is; without any there is no block.
#ifdef TERRAIN
struct Anchors {
    terrain_cell: vec2<i32>,
    terrain_frac: vec2<f32>,
    rock_cell: vec3<i32>,
    rock_frac: vec3<f32>,
#ifdef CLOUDS
#ifndef LOW_QUALITY
    // In turns of 2^32.
    cloud_turn: vec3<u32>,
#endif
#endif
}

@group(1) @binding(1) var<uniform> anchors: Anchors;
#else
#ifdef CLOUDS
#ifndef LOW_QUALITY
struct Anchors {
    cloud_turn: vec3<u32>,
}

@group(1) @binding(1) var<uniform> anchors: Anchors;
#endif
#endif
#endif

override OUTPUT: i32 = 0;
#ifdef TERRAIN
override MAX_RENDERING_DISTANCE: f32 = 60000.0;
override MAX_MARCHING_STEPS: i32 = 200;
override MAX_MARCHING_STEPS_SHADOW: i32 = 60;
override STEP_FACTOR: f32 = 0.5;
override MARCH_EPSILON: f32 = 1.0;
override OCTAVES: i32 = 10;
override OCTAVES_SHADOW: i32 = 6;
override OCTAVES_NORMAL: i32 = 11;
#ifdef TEXTURE_FILTERING
override FILTERING_SAMPLES: i32 = 2;
#endif
#endif
#ifdef ATMOSPHERE
override ATMOS_STEPS: i32 = 16;
override ATMOS_LIGHT_STEPS: i32 = 8;
#endif
#ifdef CLOUDS
#ifndef LOW_QUALITY
override CLOUD_STEPS: i32 = 64;
override CLOUD_LIGHT_STEPS: i32 = 12;
override MAX_CLOUD_DISTANCE: f32 = 80000.0;
#endif
#endif

const FAR: f32 = 1e9;
const INVERSE_PI: f32 = 0.31830989;
const ROCK_OCTAVES: i32 = 5;
const CLOUD_OCTAVES: i32 = 6;
const SNOW_OCTAVES: i32 = 4;
// The sky is lit by the sun as this altitude sees it, so that it outlasts the sunset on the ground.
const SKY_LIGHT_ALTITUDE: f32 = 3e4;

// What a pixel cost: noise evaluations, cloud density samples, cloud light samples, atmosphere samples.
struct Work {
    noise: i32,
    density: i32,
    light: i32,
    air: i32,
}

#ifdef ATMOSPHERE
fn air() -> Atmosphere {
    return Atmosphere(content.planet_radius, content.atmosphere_height, content.rayleigh_scattering,
        content.rayleigh_height, content.mie_scattering, content.mie_extinction, content.mie_height, content.mie_g);
}
#endif

// Sunlight left at an altitude where the sun has the zenith cosine `mu`.
fn sunlight(altitude: f32, mu: f32) -> vec3<f32> {
#ifdef ATMOSPHERE
    return sun_transmittance(air(), max(altitude, 0.0), mu, ATMOS_LIGHT_STEPS);
#else
    return vec3<f32>(select(0.0, 1.0, ground_distance(content.planet_radius, max(altitude, 0.0), mu) < 0.0));
#endif
}

// Light on a surface at a point with the zenith cosine `mu` of the sun, for an irradiance of 1.
fn three_lights(altitude: f32, mu: f32) -> ThreeLights {
    // The sky's light: red as the sun that it comes from, and gone when the sun is six degrees below the horizon.
    let sky = sunlight(SKY_LIGHT_ALTITUDE, mu) * smoothstep(-0.1, 0.35, mu);
    return ThreeLights(content.sun_light * sunlight(altitude, mu), content.sky_light * sky, content.bounce_light * sky);
}

#ifdef TERRAIN
fn terrain() -> Terrain {
#ifdef SMOOTH_RIDGES
    let smoothness = content.ridge_smoothness;
#else
    let smoothness = 0.0;
#endif
    return Terrain(anchors.terrain_cell, anchors.terrain_frac, content.terrain_scale, content.terrain_height,
        content.terrain_hurst, content.terrain_gain, smoothness, content.terrain_seed);
}

fn rock() -> Rock {
    return Rock(anchors.rock_cell, anchors.rock_frac, content.rock_scale, ROCK_OCTAVES, 1.0, content.rock_dark,
        content.rock_light, 0.6 * content.rock_dark, content.terrain_seed + 101u);
}

// Radiance of the terrain at `distance` along the ray, for a sun of irradiance 1.
fn surface(dir: vec3<f32>, dir_right: vec3<f32>, dir_down: vec3<f32>, distance: f32, work: ptr<function, Work>) -> vec3<f32> {
    let land = terrain();
    let point = dir * distance;
    let up = up_at(content.planet_radius, view.eye_altitude, point);
    let footprint = max(distance * length(dir_right), 0.05);
    let normal = terrain_normal(land, content.planet_radius, view.eye_altitude, point, footprint, OCTAVES_NORMAL);
    (*work).noise += 4 * OCTAVES_NORMAL;
    let altitude = altitude_of(content.planet_radius, view.eye_altitude, point);
    let shadow = soft_shadow(land, content.planet_radius, view.eye_altitude, point, normal, view.to_sun,
        0.5 + 0.001 * distance, MAX_RENDERING_DISTANCE, content.shadow_softness, STEP_FACTOR, MARCH_EPSILON,
        MAX_MARCHING_STEPS_SHADOW, OCTAVES_SHADOW);
    (*work).noise += shadow.steps * OCTAVES_SHADOW;
    let stone = rock();
    let place = vec3<f32>(point.x, altitude, point.z);
#ifdef TEXTURE_FILTERING
    let across = surface_footprint(dir, dir_right, distance, normal);
    let along = surface_footprint(dir, dir_down, distance, normal);
#ifdef TEXTURE_LOW_QUALITY
    let stone_albedo = rock_low_filtered(stone, place, across, along, FILTERING_SAMPLES);
    (*work).noise += FILTERING_SAMPLES * FILTERING_SAMPLES * ROCK_OCTAVES;
#else
    let stone_albedo = rock_high_filtered(stone, place, across, along, FILTERING_SAMPLES);
    (*work).noise += FILTERING_SAMPLES * FILTERING_SAMPLES * 4 * ROCK_OCTAVES;
#endif
#else
#ifdef TEXTURE_LOW_QUALITY
    let stone_albedo = rock_low(stone, place);
    (*work).noise += ROCK_OCTAVES;
#else
    let stone_albedo = rock_high(stone, place);
    (*work).noise += 4 * ROCK_OCTAVES;
#endif
#endif
    let border = fbm_3d(stone.cell, stone.frac + place / stone.wavelength, SNOW_OCTAVES, 1.0, stone.seed + 7u);
    (*work).noise += SNOW_OCTAVES;
    let snow = snow_blend(dot(normal, up), border, content.snow_edge_low, content.snow_edge_high, content.snow_noise);
    let albedo = mix(stone_albedo, content.snow_albedo, snow);
    let mu = dot(up, view.to_sun);
    return INVERSE_PI * albedo * shade_three_lights(three_lights(altitude, mu), normal, view.to_sun, shadow.light);
}
#endif

@fragment
fn draw(in: Corner) -> @location(0) vec4<f32> {
    // Derivatives first, while control flow is uniform.
    let pixel_right = vec2<f32>(dpdx(in.clip.x), 0.0);
    let pixel_down = vec2<f32>(0.0, dpdy(in.clip.y));
    let clip = in.clip + view.jitter.x * pixel_right + view.jitter.y * pixel_down;
    let ray = view.ray_middle + clip.x * view.ray_right + clip.y * view.ray_up;
    let scale = inverseSqrt(dot(ray, ray));
    let dir = ray * scale;
    let step_right = view.ray_right * (pixel_right.x * scale);
    let step_down = view.ray_up * (pixel_down.y * scale);
    let dir_right = step_right - dir * dot(dir, step_right);
    let dir_down = step_down - dir * dot(dir, step_down);
    var work = Work(0, 0, 0, 0);

    // What the ray ends on, before any air.
    var color = vec3<f32>(0.0);
    var distance = FAR;
#ifdef TERRAIN
    let hit = march(terrain(), content.planet_radius, view.eye_altitude, dir, 0.1, MAX_RENDERING_DISTANCE, STEP_FACTOR,
        MARCH_EPSILON, MAX_MARCHING_STEPS, OCTAVES);
    work.noise += hit.steps * OCTAVES;
    // A ray that ran out of steps next to the ground has met it; one that is far from it has not.
    let close = hit.steps == MAX_MARCHING_STEPS && hit.clearance < 0.01 * hit.reached && hit.reached <= MAX_RENDERING_DISTANCE;
    let met = select(hit.distance, hit.reached, hit.distance < 0.0 && close);
    if met >= 0.0 {
        distance = met;
        color = surface(dir, dir_right, dir_down, met, &work);
    }
#endif
    let on_sphere = ground_distance(content.planet_radius, max(view.eye_altitude, 0.0), dir.y);
    if distance == FAR && on_sphere >= 0.0 {
        distance = on_sphere;
        // The bare planet, which is also what stands for terrain beyond the farthest step.
        let up = up_at(content.planet_radius, view.eye_altitude, dir * on_sphere);
        color = INVERSE_PI * content.rock_dark * shade_three_lights(three_lights(0.0, dot(up, view.to_sun)), up, view.to_sun, 1.0);
    }
#ifdef ATMOSPHERE
    if distance == FAR {
        color = vec3<f32>(sun_disc(dir, view.to_sun, view.sun_angular_radius, length(dir_right)));
    }
    let sky = march_sky(air(), view.eye_altitude, dir, view.to_sun, distance, ATMOS_STEPS, ATMOS_LIGHT_STEPS);
    work.air += ATMOS_STEPS * (1 + ATMOS_LIGHT_STEPS);
    color = sky.in_scatter + sky.transmittance * color;
#endif
#ifdef CLOUDS
#ifndef LOW_QUALITY
    let layer = CloudLayer(anchors.cloud_turn, 1.0 / (content.cloud_scale * f32(1u << content.cloud_period_doublings)), content.cloud_period_doublings, 0.5,
        content.clouds_height, content.clouds_thickness, content.cloud_coverage, 0.0,
        content.cloud_density * (content.cloud_scattering + content.cloud_absorption),
        content.cloud_scattering / max(content.cloud_scattering + content.cloud_absorption, 1e-20),
        content.cloud_g_forward, content.cloud_g_backward, content.cloud_backward_share, content.cloud_seed);
    let nearest = min(distance, MAX_CLOUD_DISTANCE);
    let inside = clip_segment(shell_segment(content.planet_radius, content.clouds_height,
        content.clouds_height + content.clouds_thickness, view.eye_altitude, dir.y), nearest);
    if segment_length(inside) > 0.0 {
#ifdef CLOUD_JITTER
        let shift = unit_float(pcg_2d(vec2<u32>(in.position.xy) + vec2<u32>(view.frame * 7919u, view.frame)).x);
#else
        let shift = 0.5;
#endif
#ifdef CLOUD_SKIP
        let cloud = march_clouds_skip(layer, content.planet_radius, view.eye_altitude, dir, view.to_sun, nearest,
            CLOUD_STEPS, CLOUD_LIGHT_STEPS, 0.001, shift);
#else
        let cloud = march_clouds(layer, content.planet_radius, view.eye_altitude, dir, view.to_sun, nearest,
            CLOUD_STEPS, CLOUD_LIGHT_STEPS, shift);
#endif
        work.density += cloud.density_samples;
        work.light += cloud.light_samples;
        work.noise += CLOUD_OCTAVES * (cloud.density_samples + cloud.light_samples);
        let middle = content.clouds_height + 0.5 * content.clouds_thickness;
        let mu = direction_cosine_along(content.planet_radius, view.eye_altitude, middle, view.to_sun.y,
            dot(dir, view.to_sun), cloud.mean_distance);
        let at_clouds = sunlight(middle, mu);
#ifdef ATMOSPHERE
        // The air in front of the clouds, which they do not dim.
        let front = march_sky(air(), view.eye_altitude, dir, view.to_sun, cloud.mean_distance, ATMOS_STEPS, ATMOS_LIGHT_STEPS);
        work.air += ATMOS_STEPS * (1 + ATMOS_LIGHT_STEPS);
        color = composite_clouds(cloud, at_clouds, front, color);
#else
        color = cloud.scatter * at_clouds + cloud.transmittance * color;
#endif
    }
#endif
#endif
#ifdef SHOW_DISTANCE
    return vec4<f32>(select(distance, -1.0, distance == FAR), 0.0, 0.0, 1.0);
#else
#ifdef COUNT_OPERATIONS
    return vec4<f32>(f32(work.noise), f32(work.density), f32(work.light), f32(work.air));
#else
    let radiance = color * view.sun_irradiance;
    if OUTPUT == 2 {
        return vec4<f32>(radiance, 1.0);
    }
    let shown = dither(encode_srgb(exponential(radiance, view.exposure)), vec2<u32>(in.position.xy), 255.0);
    if OUTPUT == 1 {
        return vec4<f32>(decode_srgb(shown), 1.0);
    }
    return vec4<f32>(shown, 1.0);
#endif
#endif
}
    }#
}#
