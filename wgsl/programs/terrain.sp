The ground of a height field in a host's pass, with its depth: rays over baked heights, a last step on the field, three lights, rock and snow.

#PROGRAM{ terrain }#

#DEFINE{
    #VARYING{
struct Corner {
    @builtin(position) position: vec4<f32>,
    // The ray through the pixel, at the depth 1.
    @location(0) ray: vec3<f32>,
}

struct TerrainView {
    ray_middle: vec3<f32>,
    // Angle of a pixel.
    pixel_angle: f32,
    ray_right: vec3<f32>,
    // Rays end here [m].
    far: f32,
    ray_up: vec3<f32>,
    exposure: f32,
    forward: vec3<f32>,
    // Depth is depth_numerator / linear depth - depth_offset.
    depth_numerator: f32,
    to_sun: vec3<f32>,
    depth_offset: f32,
    sun_light: vec3<f32>,
    sky_light: vec3<f32>,
    snow_edge_low: f32,
    bounce_light: vec3<f32>,
    snow_edge_high: f32,
    snow_albedo: vec3<f32>,
    snow_noise: f32,
    // Height below which no snow lies [m].
    snow_line: f32,
    sea_albedo: vec3<f32>,
    // No ground stands higher [m].
    highest: f32,
    // Angular radius of the sun [rad].
    sun_radius: f32,
}

@group(0) @binding(0) var<uniform> draw_view: TerrainView;
    }#
}#

#VERTEX{
    #USE{ VARYING }#
    #CODE{
#import veduta::terrain::clipmap::{Clip}

@group(0) @binding(2) var<uniform> clip: Clip;
@group(1) @binding(1) var sectors: texture_2d<f32>;

const COLUMNS: f32 = 16.0;
const ROWS: f32 = 24.0;

fn ray_through(at: vec2<f32>) -> vec3<f32> {
    return draw_view.ray_middle + at.x * draw_view.ray_right + at.y * draw_view.ray_up;
}

// Least tangent of the elevation of the rays from `left` to `right` at a height of the picture: along an edge, which is a great circle, the tangent is a cosine of the azimuth.
fn lowest(left: f32, right: f32, y: f32) -> f32 {
    let a = ray_through(vec2<f32>(left, y));
    let b = ray_through(vec2<f32>(right, y));
    return min(a.y / max(length(a.xz), 1e-6), b.y / max(length(b.xz), 1e-6));
}

// Which rows of a column of the picture hold rays that come down to the ground around it: the highest and the lowest of them, above which and below which there is none.
fn shown_rows(column: i32) -> vec2<f32> {
    let width = 2.0 / COLUMNS;
    let height = 2.0 / ROWS;
    let near_x = f32(column) * width - 1.0;
    let far_x = near_x + width;
    let middle = ray_through(vec2<f32>(near_x + 0.5 * width, 0.0));
    // Azimuths of the corners of all rows.
    var left = 0.0;
    var right = 0.0;
    for (var j = 0; j < 4; j++) {
        let ray = ray_through(vec2<f32>(select(near_x, far_x, (j & 1) == 1), select(-1.0, 1.0, j > 1)));
        let turn = atan2(middle.x * ray.z - middle.z * ray.x, dot(middle.xz, ray.xz));
        left = min(left, turn);
        right = max(right, turn);
    }
    // Columns around the zenith see all sectors.
    let wide = right - left > 1.2;
    let azimuth = atan2(middle.z, middle.x);
    let by_radian = f32(clip.sectors) * 0.15915494309;
    let first = select(i32(floor((azimuth + left - 1e-3) * by_radian)), clip.first_sector, wide);
    let last = select(i32(floor((azimuth + right + 1e-3) * by_radian)), clip.first_sector + clip.made_sectors - 1, wide);
    // Of 64 rings each.
    let blocks = clip.rings + (clip.rings >> 3u);
    var skyline = -1e30;
    for (var j = first; j <= last; j++) {
        for (var k = 0; k < (clip.rings >> 6u); k++) {
            skyline = max(skyline, textureLoad(sectors, vec2<i32>(blocks + k, j & (clip.sectors - 1)), 0).x);
        }
    }
    let bend = select(max(cos(right - left), 0.3), 1.0, wide);
    var rows = vec2<f32>(2.0, -2.0);
    var below = lowest(near_x, far_x, -1.0);
    for (var j = 0; j < i32(ROWS); j++) {
        let low = f32(j) * height - 1.0;
        let above = lowest(near_x, far_x, low + height);
        let least = min(below, above);
        let bound = least / select(bend, 1.0, least > 0.0);
        if skyline >= bound - 1e-3 * (1.0 + abs(bound)) || (wide && least < 0.0) {
            rows = vec2<f32>(min(rows.x, low), low + height);
        }
        below = above;
    }
    return rows;
}

// One triangle over the part of the picture that lies below a line, level in the world, which is as low as all columns' ground lets it be; without ground it has no size. Narrow columns of their own, or
// two triangles, have longer borders: on devices that shade blocks of pixels those are shaded twice and more.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let rise = vec2<f32>(draw_view.ray_right.y, draw_view.ray_up.y);
    let steep = length(rise);
    let up = select(vec2<f32>(0.0, 1.0), rise / max(steep, 1e-30), steep > 1e-9);
    var line = -4.0;
    for (var column = 0; column < i32(COLUMNS); column++) {
        let rows = shown_rows(column);
        let side = (f32(column) + select(0.0, 1.0, up.x > 0.0)) * 2.0 / COLUMNS - 1.0;
        line = select(line, max(line, up.x * side + max(up.y * rows.x, up.y * rows.y)), rows.y > rows.x);
    }
    // From there on down it is wider than the picture, whichever way that is turned.
    let across = vec2<f32>(up.y, -up.x);
    let at = up * (line - select(0.0, 6.0, index == 2u)) + across * select(select(-3.0, 3.0, index == 1u), 0.0, index == 2u);
    return Corner(vec4<f32>(select(vec2<f32>(0.0), at, line > -3.0), 0.5, 1.0), ray_through(at));
}
    }#
}#

#FRAGMENT{
    #CODE{
#import veduta::planet::shell::{altitude_of}
#import veduta::terrain::clipmap::{Clip, Sweep, sun_share}
#import veduta::terrain::field::{Field, height_spread}
#import veduta::terrain::relief::{bare_land_at, land_at}
#import veduta::terrain::refine::{found_hit, field_sun_share}
#import veduta::terrain::material::{Rock, faded_noise, rock_low_faded, rock_high_faded, snow_blend}
#import veduta::terrain::shading::{ThreeLights, shade_rough}
#import veduta::terrain::sky_share::{sky_share}
#ifdef CLOUD_SHADOWS
#import veduta::clouds::tile::{CloudTile, cloud_shadow}
#endif
#import veduta::post::display::{displayed}
    }#
    #USE{ VARYING }#
    #CODE{
@group(0) @binding(1) var<uniform> field: Field;
@group(0) @binding(2) var<uniform> clip: Clip;
@group(0) @binding(3) var<uniform> rock: Rock;
@group(0) @binding(4) var<uniform> sweep: Sweep;
@group(1) @binding(0) var heights: texture_2d_array<f32>;
@group(1) @binding(1) var sectors: texture_2d<f32>;
@group(1) @binding(2) var places: texture_2d<f32>;
@group(1) @binding(3) var shades: texture_2d_array<f32>;
@group(1) @binding(4) var wrapping: sampler;
@group(1) @binding(5) var relief: texture_2d<f32>;
#ifdef CLOUD_SHADOWS
@group(2) @binding(0) var<uniform> cloud_layer: CloudTile;
@group(2) @binding(1) var cloud_sampler: sampler;
@group(2) @binding(2) var cloud_tile: texture_3d<f32>;
#endif

override FIELD_KIND: i32 = 2;
override OUTPUT: i32 = 0;
// Most steps of a ray.
override CLIP_STEPS: i32 = 500;
// Steps from the baked ground to the field.
override REFINE_STEPS: i32 = 2;
// Most places where the field itself is looked for, where texels are wider than footprints.
override SEARCH_STEPS: i32 = 48;
// Most places towards the sun at which the field itself is looked at; 0: what is baked tells its share.
override SUN_STEPS: i32 = 0;
// Whether the rock has one fractal instead of four.
override ROCK_CHEAP: i32 = 0;
// Sectors in which horizons take light off the sky; 0: none.
override SKY_SECTORS: i32 = 0;

const INVERSE_PI: f32 = 0.31830988618;

struct Shown {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn draw(in: Corner) -> Shown {
    let dir = normalize(in.ray);
    let angle = draw_view.pixel_angle;
    let found = found_hit(heights, wrapping, sectors, places, relief, clip, field, FIELD_KIND, dir, draw_view.far, angle, CLIP_STEPS, REFINE_STEPS, SEARCH_STEPS);
    // Where nothing is met the rest takes no rounds of any loop.
    let is_met = found.distance >= 0.0;
    let point = dir * max(found.distance, 1e-3);
    // A pixel covers more ground the more it slants.
    var slant = found.slope;
    if SUN_STEPS > 0 {
        slant = land_at(relief, field, FIELD_KIND, point.xz, select(1e30, angle * found.distance, is_met)).slope;
    }
    let normal = normalize(vec3<f32>(-slant.x, 1.0, -slant.y));
    let footprint = select(1e30, angle * found.distance / max(-dot(normal, dir), 0.05), is_met);
    // The ground below the sea too, to blend their border over the heights that a footprint holds.
    let ground = bare_land_at(relief, field, FIELD_KIND, point.xz, footprint);
    let left = clamp(f32(field.octaves) - log2(field.wavelength / footprint), 0.0, f32(field.octaves));
    // A smooth step of half a width of 2.24 has a deviation of 1.
    let tidal = max(2.24 * height_spread(ground.slope, ground.lost, footprint, left, field.fall), 0.01);
    let land = smoothstep(-tidal, tidal, ground.height - field.sea);
    let altitude = altitude_of(clip.ground_radius, clip.eye_altitude, point);
    var light = 1.0;
    if SUN_STEPS > 0 {
        light = field_sun_share(relief, field, FIELD_KIND, clip.ground_radius, point.xz, max(ground.height, field.sea), footprint, draw_view.to_sun, draw_view.sun_radius, draw_view.highest, draw_view.far, select(0, SUN_STEPS, is_met));
    } else {
        light = sun_share(heights, shades, wrapping, places, clip, sweep, point.xz);
    }
#ifdef CLOUD_SHADOWS
    light *= cloud_shadow(cloud_tile, cloud_sampler, cloud_layer, point.xz, altitude);
#endif
    let place = vec3<f32>(point.x, altitude, point.z);
    var albedo = vec3<f32>(0.0);
    if ROCK_CHEAP != 0 {
        albedo = rock_low_faded(rock, place, footprint);
    } else {
        albedo = rock_high_faded(rock, place, footprint);
    }
    let border = faded_noise(rock, place, vec3<i32>(1, 1, 1), 7u, footprint);
    // Slopes that are not resolved make the ground steeper than it looks, and the border of the snow wider.
    let slope = land * ground.slope;
    let lost = land * ground.lost;
    let level = inverseSqrt(1.0 + dot(slope, slope) + lost);
    let blur = 1.2 * level * level * sqrt(lost * (1.0 - level * level));
    let high = smoothstep(draw_view.snow_line - 100.0, draw_view.snow_line + 100.0, altitude + 200.0 * border);
    let snow = high * snow_blend(level, border, draw_view.snow_edge_low - blur, draw_view.snow_edge_high + blur, draw_view.snow_noise);
    albedo = mix(draw_view.sea_albedo, mix(albedo, draw_view.snow_albedo, snow), land);
    var open = 1.0;
    if SKY_SECTORS > 0 {
        open = sky_share(heights, wrapping, places, clip, point.xz, altitude, slope, footprint, select(0, SKY_SECTORS, is_met));
    }
    let lights = ThreeLights(draw_view.sun_light, open * draw_view.sky_light, draw_view.bounce_light);
    let radiance = INVERSE_PI * albedo * shade_rough(lights, slope, lost, draw_view.to_sun, light);
    if !is_met {
        discard;
    }
    let linear = max(dot(point, draw_view.forward), 1e-6);
    return Shown(displayed(OUTPUT, radiance, draw_view.exposure, vec2<u32>(in.position.xy)), clamp(draw_view.depth_numerator / linear - draw_view.depth_offset, 0.0, 1.0));
}
    }#
}#
