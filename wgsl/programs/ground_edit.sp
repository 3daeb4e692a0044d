Changes of the ground and its water under a cursor, or everywhere.

#PROGRAM{ ground_edit }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, row_at, place_of, cell_place, plane_of, columns_of, from_left, from_right}
#import veduta::ground::exact::{add_exactly}
#import veduta::noise::value::{value_noise_2d}

@group(0) @binding(0) var<uniform> now: GroundStep;
struct Edit {
    // Cursor in cells and its radius; below 0: everywhere.
    x: f32,
    z: f32,
    radius: f32,
    strength: f32,
    // 0 raise, 1 smooth, 2 noise, 3 water, 4 flatten.
    tool: i32,
    // Height to flatten to, over the reference level.
    height: f32,
    // Wavelength of noise in cells.
    wavelength: f32,
    seed: u32,
}

@group(0) @binding(1) var<uniform> tool: Edit;
@group(1) @binding(0) var<storage, read> ground: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read_write> tiles: array<atomic<u32>>;
@group(2) @binding(0) var<storage, read_write> change: array<vec4<f32>>;
@group(2) @binding(1) var<storage, read_write> water: array<vec4<f32>>;

fn row(z: i32, group: i32, left: i32, right: i32, last: vec4<bool>) -> vec4<f32> {
    let at = row_at(now, z);
    let here = ground[place_of(now, group, at)];
    let l = cell_place(now, left, at);
    let r = cell_place(now, right, at);
    // The weights 1, 2, 1 along x.
    return (2.0 * here + (from_left(here, ground[l >> 2u][l & 3]) + from_right(here, ground[r >> 2u][r & 3], last))) * 0.25;
}

@compute @workgroup_size(64)
fn edit(@builtin(global_invocation_id) id: vec3<u32>) {
    let group = i32(id.x);
    let z = i32(id.y);
    if group >= now.groups {
        return;
    }
    let plane = plane_of(now);
    let at = place_of(now, group, z);
    let columns = columns_of(group);
    let inside = select(vec4<f32>(0.0), vec4<f32>(1.0), columns < vec4<i32>(now.columns));
    let wraps = now.boundary == 2;
    var dx = vec4<f32>(columns) - tool.x;
    var dz = f32(z) - tool.z;
    if wraps {
        // The nearest of the cursors that a periodic ground has.
        dx -= f32(now.columns) * round(dx / f32(now.columns));
        dz -= f32(now.rows) * round(dz / f32(now.rows));
    }
    let r = sqrt(dx * dx + dz * dz) / max(tool.radius, 1e-3);
    let fade = max(1.0 - r * r, vec4<f32>(0.0));
    let share = inside * select(fade * fade, vec4<f32>(1.0), vec4<bool>(tool.radius < 0.0));
    let x = 4 * group;
    let left = select(max(x - 1, 0), now.columns - 1, wraps && x == 0);
    let right = select(min(x + 4, now.columns - 1), 0, wraps && x + 4 >= now.columns);
    let last = columns == vec4<i32>(now.columns - 1);
    let here = ground[at];
    let mean = (2.0 * row(z, group, left, right, last) + (row(z - 1, group, left, right, last) + row(z + 1, group, left, right, last))) * 0.25;
    var rough = vec4<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        let p = vec2<f32>(vec2<i32>(columns[k], z)) / max(tool.wavelength, 1.0);
        rough[k] = value_noise_2d(vec2<i32>(floor(p)), p - floor(p), tool.seed);
    }
    var more = vec4<f32>(tool.strength);
    if tool.tool == 1 {
        more = (mean - here) * clamp(tool.strength, 0.0, 1.0);
    }
    if tool.tool == 2 {
        more = rough * tool.strength;
    }
    if tool.tool == 4 {
        more = (vec4<f32>(tool.height) - here) * clamp(tool.strength, 0.0, 1.0);
    }
    more *= share;
    let tile = (z >> 5u) * now.tiles_x + (group >> 3u);
    if any(share > vec4<f32>(0.0)) {
        atomicStore(&tiles[16 + tile], 1u);
    }
    if tool.tool == 3 {
        let had = water[at];
        let pair = add_exactly(had, water[plane + at], max(more, -had), now.none);
        let after = max(pair.value, vec4<f32>(0.0));
        water[at] = after;
        // The next step's length follows the waves of what was poured.
        let deepest = max(max(after.x, after.y), max(after.z, after.w));
        atomicMax(&tiles[16 + now.tiles + tile], bitcast<u32>(sqrt(now.gravity * deepest)));
        water[plane + at] = select(pair.lost, vec4<f32>(0.0), pair.value <= vec4<f32>(0.0));
    } else {
        let pair = add_exactly(change[at], change[plane + at], more, now.none);
        change[at] = pair.value;
        change[plane + at] = pair.lost;
    }
}
    }#
}#
