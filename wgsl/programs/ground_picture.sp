The ground and its water as a grid of triangles in a host's pass: places from indices, heights from textures, lit by sun and sky.

#PROGRAM{ ground_picture }#

#DEFINE{
    #VARYING{
struct GroundCorner {
    @builtin(position) @invariant position: vec4<f32>,
    // From the eye [m].
    @location(0) place: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) water_normal: vec3<f32>,
    // Displayed water over the ground, mean depth of the water, altitude [m].
    @location(3) depths: vec3<f32>,
}

struct GroundView {
    clip_from_place: mat4x4<f32>,
    // The first cell from the eye, at the reference level [m].
    corner: vec3<f32>,
    spacing: f32,
    to_sun: vec3<f32>,
    exposure: f32,
    sun_light: vec3<f32>,
    // Altitude of the reference level [m].
    reference: f32,
    sky_light: vec3<f32>,
    columns: i32,
    bounce_light: vec3<f32>,
    rows: i32,
    // Albedos of gentle ground, low and high, of steep ground, and of ground that has been wet.
    low_albedo: vec3<f32>,
    low: f32,
    high_albedo: vec3<f32>,
    high: f32,
    steep_albedo: vec3<f32>,
    steep_from: f32,
    mud_albedo: vec3<f32>,
    steep_to: f32,
    // Of the water, by metre, and albedo of deep water.
    extinction: vec3<f32>,
    // Mean depth from which ground is all mud [m].
    mud_depth: f32,
    water_albedo: vec3<f32>,
    blocks_x: i32,
}

@group(0) @binding(0) var<uniform> draw_view: GroundView;

// 0 the ground, 1 its water.
override GROUND_LAYER: i32 = 0;
    }#
}#

#VERTEX{
    #USE{ VARYING }#
    #CODE{
@group(1) @binding(0) var surface: texture_2d<f32>;
@group(1) @binding(1) var normals: texture_2d<u32>;

// Unit vector from its x and z.
fn upright(level: vec2<f32>) -> vec3<f32> {
    return vec3<f32>(level.x, sqrt(max(1.0 - dot(level, level), 0.0)), level.y);
}

struct Cell {
    // Height, displayed level, depth, mean.
    surface: vec4<f32>,
    normal: vec3<f32>,
    water_normal: vec3<f32>,
}

fn cell(at: vec2<i32>) -> Cell {
    let packed = textureLoad(normals, at, 0).xy;
    return Cell(textureLoad(surface, at, 0), upright(unpack2x16snorm(packed.x)), upright(unpack2x16snorm(packed.y)));
}

// Blocks of 64 x 64 squares: corners by rows of 65, then middles by rows of 64. What lies beyond the last cell falls together with it.
@vertex
fn lift(@builtin(vertex_index) index: u32, @builtin(instance_index) block: u32) -> GroundCorner {
    let end = vec2<i32>(draw_view.columns - 1, draw_view.rows - 1);
    let start = 64 * vec2<i32>(i32(block) % draw_view.blocks_x, i32(block) / draw_view.blocks_x);
    let k = i32(index);
    let middle = k >= 4225;
    let m = k - 4225;
    let inner = select(vec2<i32>(k % 65, k / 65), vec2<i32>(m % 64, m / 64), middle);
    let first = min(start + inner, end);
    var at = vec2<f32>(first);
    var found = cell(first);
    if middle {
        let last = min(first + 1, end);
        let b = cell(vec2<i32>(last.x, first.y));
        let c = cell(vec2<i32>(first.x, last.y));
        let d = cell(last);
        at = 0.5 * (at + vec2<f32>(last));
        found.surface = 0.25 * ((found.surface + d.surface) + (b.surface + c.surface));
        found.normal += d.normal + b.normal + c.normal;
        found.water_normal += d.water_normal + b.water_normal + c.water_normal;
    }
    let level = select(found.surface.x, found.surface.y, GROUND_LAYER == 1);
    let place = draw_view.corner + vec3<f32>(at.x * draw_view.spacing, level, at.y * draw_view.spacing);
    let depths = vec3<f32>(found.surface.y - found.surface.x, found.surface.w, draw_view.reference + found.surface.x);
    return GroundCorner(draw_view.clip_from_place * vec4<f32>(place, 1.0), place, normalize(found.normal), normalize(found.water_normal), depths);
}
    }#
}#

#FRAGMENT{
    #CODE{
#import veduta::terrain::shading::{ThreeLights, shade_three_lights}
#import veduta::post::display::{displayed}
    }#
    #USE{ VARYING }#
    #CODE{
override OUTPUT: i32 = 0;

const INVERSE_PI: f32 = 0.31830988618;

// Albedo of dry or wet ground by slope, altitude and the mean of its water.
fn albedo_of(normal: vec3<f32>, altitude: f32, mean: f32, under: f32) -> vec3<f32> {
    let gentle = mix(draw_view.low_albedo, draw_view.high_albedo, smoothstep(draw_view.low, draw_view.high, altitude));
    let slope = length(normal.xz) / max(normal.y, 1e-3);
    let steep = smoothstep(draw_view.steep_from, draw_view.steep_to, slope);
    let bare = mix(gentle, draw_view.steep_albedo, steep);
    let wet = smoothstep(0.0, draw_view.mud_depth, mean);
    // Mud on gentle ground; rock only darkens.
    return mix(bare, mix(draw_view.mud_albedo, 0.6 * bare, steep), wet) * (1.0 - 0.3 * under);
}

@fragment
fn draw(in: GroundCorner) -> @location(0) vec4<f32> {
    let water = in.depths.x;
    let normal = normalize(in.normal);
    let lights = ThreeLights(draw_view.sun_light, draw_view.sky_light, draw_view.bounce_light);
    // Ground under water is darker.
    let under = smoothstep(0.0, 0.05, water);
    let bed = INVERSE_PI * albedo_of(normal, in.depths.z, in.depths.y, under) * shade_three_lights(lights, normal, draw_view.to_sun, 1.0);
    if GROUND_LAYER == 0 {
        // Shallow water covers its ground at every place, so that the two never fight for a pixel; deep water lies far above it.
        if water > 2e-3 && water < 1.0 {
            discard;
        }
        return displayed(OUTPUT, bed, draw_view.exposure, vec2<u32>(in.position.xy));
    }
    let up = normalize(in.water_normal);
    let to_eye = normalize(-in.place);
    let facing = clamp(dot(up, to_eye), 0.0, 1.0);
    // Light goes down from the sun and back to the eye, both bent towards the normal.
    let bent = sqrt(1.0 - (1.0 - facing * facing) / 1.777);
    let bent_sun = sqrt(1.0 - (1.0 - draw_view.to_sun.y * draw_view.to_sun.y) / 1.777);
    let path = max(water, 0.0) * (1.0 / bent + 1.0 / bent_sun);
    let through = exp(-draw_view.extinction * path);
    let deep = INVERSE_PI * draw_view.water_albedo * shade_three_lights(lights, up, draw_view.to_sun, 1.0);
    let grazing = 1.0 - facing;
    let square = grazing * grazing;
    let mirrored = (0.02 + 0.98 * square * square * grazing) * under;
    let radiance = mix(mix(deep, bed, through), INVERSE_PI * draw_view.sky_light, mirrored);
    if water <= 0.0 {
        discard;
    }
    return displayed(OUTPUT, radiance, draw_view.exposure, vec2<u32>(in.position.xy));
}
    }#
}#
