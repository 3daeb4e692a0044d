First half of a step of the source's water: outflow speeds from differences of level, in place. With GROUND_EROSION also what the water digs and lays down, and what slides.

#PROGRAM{ ground_speeds }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, strip_of, place_of, row_after, plane_of, row_at, columns_of, from_left, from_right}
#import veduta::ground::flow::{level_drop, driven_speed, outflow_share}
#import veduta::ground::exact::{opaque}
#ifdef GROUND_EROSION
#import veduta::ground::erosion::{capacity, dissolved, slid}
#import veduta::ground::exact::{add_exactly}
#import veduta::noise::value::{value_noise_2d}
#endif

@group(0) @binding(0) var<uniform> now: GroundStep;
// Planes one after the other: water and what rounding took from it; ground over the reference level, ground base.
@group(1) @binding(0) var<storage, read> water: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read> ground: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read_write> tiles: array<atomic<u32>>;
// Outflow speeds to +x and -x, to +z and -z.
@group(2) @binding(0) var<storage, read_write> speeds_x: array<vec4<f32>>;
@group(2) @binding(1) var<storage, read_write> speeds_z: array<vec4<f32>>;
#ifdef GROUND_EROSION
// The mean of the water, the load per water; the load and the change of the ground, each with what rounding took.
@group(2) @binding(2) var<storage, read_write> means: array<vec4<f32>>;
@group(2) @binding(3) var<storage, read_write> load: array<vec4<f32>>;
@group(2) @binding(4) var<storage, read_write> change: array<vec4<f32>>;

// How easily ground is dug: 1 soft.
fn softness(columns: vec4<i32>, row: i32, height: vec4<f32>) -> vec4<f32> {
    var hard = vec4<f32>(0.0);
    let spots = i32(now.hardness > 0.0 && now.hard_wavelength > 0.0);
    for (var k = 0; k < 4 * spots; k++) {
        let at = vec2<f32>(vec2<i32>(columns[k], row)) / max(now.hard_wavelength, 1.0);
        let cell = floor(at);
        hard[k] = 0.5 + 0.5 * value_noise_2d(vec2<i32>(cell), at - cell, 7u);
    }
    let layers = now.layer > 0.0;
    let band = 0.5 + 0.5 * cos(6.2831853 * fract(height / max(now.layer, 1e-3)));
    hard = select(hard, band, layers);
    return 1.0 - now.hardness * hard;
}
#endif

fn level(index: i32) -> f32 {
    return water[index >> 2u][index & 3] + ground[index >> 2u][index & 3];
}

@compute @workgroup_size(8)
fn speeds(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) id: vec3<u32>) {
    let place = strip_of(now, i32(atomicLoad(&tiles[16 + 2 * now.tiles + i32(id.x)])), i32(lane));
    if place.group >= now.groups {
        return;
    }
    let step = now.step;
    let plane = plane_of(now);
    let columns = columns_of(place.group);
    let last = columns == vec4<i32>(now.columns - 1);
    let inside = select(vec4<f32>(0.0), vec4<f32>(1.0), columns < vec4<i32>(now.columns));
    let walls = now.boundary == 1;
    let falls = now.boundary == 0;
    let beyond_left = (columns == vec4<i32>(0)) & vec4<bool>(now.boundary != 2);
    let beyond_right = last & vec4<bool>(now.boundary != 2);
    let open_x = inside * select(vec4<f32>(1.0), vec4<f32>(0.0), beyond_left & vec4<bool>(walls));
    let open_right = inside * select(vec4<f32>(1.0), vec4<f32>(0.0), beyond_right & vec4<bool>(walls));
    let before_row = place_of(now, place.group, row_at(now, place.first - 1));
    let first_row = place.at;
    var low_ground = ground[before_row];
    var low = low_ground + water[before_row];
    var here_ground = ground[first_row];
    var here_water = water[first_row];
    for (var z = place.first; z < place.end; z++) {
        let at = place.at + (z - place.first) * place.pitch;
        let next = row_after(now, place, at, z);
        let high_ground = ground[next];
        let high_water = water[next];
        let here = here_ground + here_water;
        let high = high_ground + high_water;
        let beyond_low = vec4<bool>(z == 0 && now.boundary != 2);
        let beyond_high = vec4<bool>(z == now.rows - 1 && now.boundary != 2);
        let left_at = place.left + (z - place.first) * place.left_pitch;
        let right_at = place.right + (z - place.first) * place.right_pitch;
        // Open edges: the same ground without water.
        let open = vec4<bool>(falls);
#ifdef GROUND_EROSION
        let left_ground = from_left(here_ground, ground[left_at >> 2u][left_at & 3]);
        let right_ground = from_right(here_ground, ground[right_at >> 2u][right_at & 3], last);
        let left_level = left_ground + from_left(here_water, water[left_at >> 2u][left_at & 3]);
        let right_level = right_ground + from_right(here_water, water[right_at >> 2u][right_at & 3], last);
#else
        let left_level = from_left(here, level(left_at));
        let right_level = from_right(here, level(right_at), last);
#endif
        let to_right = level_drop(here, select(right_level, here_ground, beyond_right & open), here_water);
        let to_left = level_drop(here, select(left_level, here_ground, beyond_left & open), here_water);
        let to_high = level_drop(here, select(high, here_ground, beyond_high & open), here_water);
        let to_low = level_drop(here, select(low, here_ground, beyond_low & open), here_water);
        let open_high = inside * select(1.0, 0.0, beyond_high.x && walls);
        let open_low = inside * select(1.0, 0.0, beyond_low.x && walls);
        var right = open_right * driven_speed(speeds_x[at], to_right, step, now.damping);
        var left = open_x * driven_speed(speeds_x[plane + at], to_left, step, now.damping);
        var up = open_high * driven_speed(speeds_z[at], to_high, step, now.damping);
        var down = open_low * driven_speed(speeds_z[plane + at], to_low, step, now.damping);
        // Sums by pairs that no compiler may put in another order.
        let share = outflow_share(here_water, (opaque(right + left, now.none) + opaque(up + down, now.none)) * step);
        right *= share;
        left *= share;
        up *= share;
        down *= share;
        speeds_x[at] = right;
        speeds_x[plane + at] = left;
        speeds_z[at] = up;
        speeds_z[plane + at] = down;
#ifdef GROUND_EROSION
        let along = right - left;
        let across = up - down;
        // Products that no compiler may fuse into sums, so that mirrored grounds stay mirrored.
        let speed = sqrt(opaque(along * along, now.none) + opaque(across * across, now.none));
        let soft = softness(columns, z, here_ground + now.reference);
        let loaded = load[at];
        let dug = inside * dissolved(loaded, capacity(speed, here_water, now.strength, now.deepest), soft, here_water, now.dig, now.lay);
        let more = add_exactly(loaded, load[plane + at], dug, now.none);
        load[at] = more.value;
        load[plane + at] = more.lost;
        means[plane + at] = max(more.value, vec4<f32>(0.0)) / max(here_water, vec4<f32>(1e-12)) * 0.999999;
        let sides = opaque(slid(here_ground, select(right_ground, here_ground, beyond_right), now.steepest, now.slide), now.none)
            + opaque(slid(here_ground, select(left_ground, here_ground, beyond_left), now.steepest, now.slide), now.none);
        let ends = opaque(slid(here_ground, select(high_ground, here_ground, beyond_high), now.steepest, now.slide), now.none)
            + opaque(slid(here_ground, select(low_ground, here_ground, beyond_low), now.steepest, now.slide), now.none);
        let moved = inside * (sides + ends);
        let other = add_exactly(change[at], change[plane + at], -dug, now.none);
        let changed = add_exactly(other.value, other.lost, moved, now.none);
        change[at] = changed.value;
        change[plane + at] = changed.lost;
        if any((abs(moved) > vec4<f32>(0.0)) | (abs(dug) > vec4<f32>(1e-9))) {
            atomicStore(&tiles[16 + i32(atomicLoad(&tiles[16 + 2 * now.tiles + i32(id.x)]))], 1u);
        }
#endif
        low_ground = here_ground;
        low = here;
        here_ground = high_ground;
        here_water = high_water;
    }
}
    }#
}#
