First half of a step of shallow water: speeds on the faces towards +x and +z, by advection that keeps momentum, gravity and friction.

#PROGRAM{ ground_shallow }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, strip_of, place_of, cell_place, row_after, plane_of, row_at, columns_of, from_left, from_right, sourced}
#import veduta::ground::exact::{opaque}
#import veduta::ground::flow::{level_drop}
#import veduta::ground::shallow::{sill_depth, rubbed_speed}

// Whether there may be rain or springs.
override GROUND_FRESH: i32 = 1;

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(0) @binding(1) var<uniform> sources: mat4x4<f32>;
@group(1) @binding(0) var<storage, read> water: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read> ground: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read_write> tiles: array<atomic<u32>>;
// Speeds and discharges through the faces to +x, to +z.
@group(1) @binding(3) var<storage, read> old_x: array<vec4<f32>>;
@group(1) @binding(4) var<storage, read> old_z: array<vec4<f32>>;
@group(2) @binding(0) var<storage, read_write> faces_x: array<vec4<f32>>;
@group(2) @binding(1) var<storage, read_write> faces_z: array<vec4<f32>>;

struct Flow {
    // Speed of the face, and of the faces before, behind, below and above it.
    speed: vec4<f32>,
    before: vec4<f32>,
    behind: vec4<f32>,
    below: vec4<f32>,
    above: vec4<f32>,
    // Discharges through the middles of the cells on both sides, and across, of the near and of the far cell.
    in_before: vec4<f32>,
    in_behind: vec4<f32>,
    near_below: vec4<f32>,
    far_below: vec4<f32>,
    near_above: vec4<f32>,
    far_above: vec4<f32>,
    // What rains and springs up in a second, at rest.
    fresh: vec4<f32>,
}

fn next_speed(flow: Flow, ground_near: vec4<f32>, near: vec4<f32>, ground_far: vec4<f32>, far: vec4<f32>, step: f32) -> vec4<f32> {
    let none = vec4<f32>(0.0);
    let rise = ground_far - ground_near;
    let over_near = sill_depth(near, rise);
    let over_far = sill_depth(far, -rise);
    // What is moved stands over the higher ground: a film that falls into deep water has no share in that water's inertia.
    let depth = max(0.5 * (over_near + over_far), vec4<f32>(1e-7));
    // Where the flow gains speed along itself it keeps its head, else its momentum.
    let head_before = max(0.5 * (flow.before + flow.speed), none) * depth;
    let head_behind = max(-0.5 * (flow.behind + flow.speed), none) * depth;
    let with_before = max(flow.in_before, none);
    let with_behind = max(-flow.in_behind, none);
    let from_before = select(with_before, min(with_before, head_before), flow.speed > flow.before);
    let from_behind = select(with_behind, min(with_behind, head_behind), flow.speed < flow.behind);
    // Of what runs across, that which stands over the higher ground alone is of this speed.
    let near_share = over_near / max(near, vec4<f32>(1e-9));
    let far_share = over_far / max(far, vec4<f32>(1e-9));
    let below = 0.5 * (opaque(flow.near_below * near_share, now.none) + opaque(flow.far_below * far_share, now.none));
    let above = 0.5 * (opaque(flow.near_above * near_share, now.none) + opaque(flow.far_above * far_share, now.none));
    let from_below = max(below, none);
    let from_above = max(-above, none);
    let scale = step / now.spacing;
    let share = scale / depth;
    let all = ((from_before + from_behind) + (from_below + from_above)) * share;
    // Products that no compiler may fuse into sums, so that mirrored grounds stay mirrored.
    let along = opaque(from_before * (flow.before - flow.speed), now.none) + opaque(from_behind * (flow.behind - flow.speed), now.none);
    let across = opaque(from_below * (flow.below - flow.speed), now.none) + opaque(from_above * (flow.above - flow.speed), now.none);
    let gain = along + across;
    var carried = flow.speed + gain * (share / max(all, vec4<f32>(1.0)));
    if GROUND_FRESH != 0 {
        carried *= depth / (depth + flow.fresh * step);
    }
    let drop = level_drop(ground_near + near, ground_far + far, max(near, far));
    // Small depths over high ground: the levels' difference is that of depths less the rise, which rounds less.
    let fine = select((near - far) - rise, none, drop == none);
    let driven = carried + (now.gravity * scale) * fine;
    let rubbed = rubbed_speed(driven, max(over_near, over_far), now.friction, now.gravity, step);
    let most = vec4<f32>(0.249 * now.spacing / step);
    let held = clamp(rubbed, -most, most);
    // Speeds only where water comes from; what creeps, rests.
    let dry = vec4<f32>(1e-7);
    let ahead = select(none, max(held, none), over_near > dry);
    let back = select(none, min(held, none), over_far > dry);
    let found = ahead + back;
    return select(found, none, abs(found) < vec4<f32>(1e-8));
}

@compute @workgroup_size(8)
fn shallow(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) id: vec3<u32>) {
    let tile = i32(atomicLoad(&tiles[16 + 2 * now.tiles + i32(id.x)]));
    let place = strip_of(now, tile, i32(lane));
    if place.group >= now.groups {
        return;
    }
    let step = bitcast<f32>(atomicLoad(&tiles[1]));
    let plane = plane_of(now);
    let columns = columns_of(place.group);
    let last = columns == vec4<i32>(now.columns - 1);
    let ends = now.boundary != 2;
    let has_left = select(vec4<f32>(1.0), vec4<f32>(0.0), (columns == vec4<i32>(0)) & vec4<bool>(ends));
    let has_right = select(vec4<f32>(1.0), vec4<f32>(0.0), (columns >= vec4<i32>(now.columns - 1)) & vec4<bool>(ends));
    let inside = select(vec4<f32>(0.0), vec4<f32>(1.0), columns < vec4<i32>(now.columns));
    let low_row = row_at(now, place.first - 1);
    let low_at = place_of(now, place.group, low_row);
    let first_at = place.at;
    var has_low = select(1.0, 0.0, place.first == 0 && ends);
    var low_u = old_x[low_at];
    var low_w = old_z[low_at] * has_low;
    var low_qz = old_z[plane + low_at] * has_low;
    let low_end = cell_place(now, place.right_column, low_row);
    var low_qz_end = old_z[plane + (low_end >> 2u)][low_end & 3] * has_low;
    var u = old_x[first_at];
    var w = old_z[first_at];
    var qx = old_x[plane + first_at];
    var qz = old_z[plane + first_at];
    var here_water = water[first_at];
    var here_ground = ground[first_at];
    let first_left = place.left;
    var qx_left = has_left * from_left(qx, old_x[plane + (first_left >> 2u)][first_left & 3]);
    var stirs = vec4<f32>(0.0);
    // The cells behind the faces to the right.
    let right_columns = select(columns + vec4<i32>(1), vec4<i32>(0), last & vec4<bool>(!ends));
    var spring = vec4<f32>(0.0);
    if GROUND_FRESH != 0 {
        spring = sourced(sources, now.sources, columns, place.first);
    }
    for (var z = place.first; z < place.end; z++) {
        let high_row = row_at(now, z + 1);
        var right_spring = vec4<f32>(0.0);
        var high_spring = vec4<f32>(0.0);
        if GROUND_FRESH != 0 {
            right_spring = sourced(sources, now.sources, right_columns, z);
            high_spring = sourced(sources, now.sources, columns, high_row);
        }
        let at = place.at + (z - place.first) * place.pitch;
        let next = row_after(now, place, at, z);
        let left_at = place.left + (z - place.first) * place.left_pitch;
        let right_at = place.right + (z - place.first) * place.right_pitch;
        let left_group = left_at >> 2u;
        let right_group = right_at >> 2u;
        let left_lane = left_at & 3;
        let right_lane = right_at & 3;
        let has_high = select(1.0, 0.0, z == now.rows - 1 && ends);
        has_low = select(1.0, 0.0, z == 0 && ends);
        let high_u = old_x[next];
        let high_w = old_z[next];
        let high_qx = old_x[plane + next];
        let high_qz = old_z[plane + next];
        let high_water = water[next];
        let high_ground = ground[next];
        let high_left = cell_place(now, place.left_column, high_row);
        let high_qx_left = has_left * from_left(high_qx, old_x[plane + (high_left >> 2u)][high_left & 3]);
        let right_water = from_right(here_water, water[right_group][right_lane], last);
        let right_ground = from_right(here_ground, ground[right_group][right_lane], last);
        let right_u = from_right(u, old_x[right_group][right_lane], last);
        let right_qx = from_right(qx, old_x[plane + right_group][right_lane], last);
        let left_u = has_left * from_left(u, old_x[left_group][left_lane]);
        let qz_end = old_z[plane + right_group][right_lane];
        let right_qz = from_right(qz, qz_end, last);
        let right_low_qz = from_right(low_qz, low_qz_end, last);
        let left_w = from_left(w, old_z[left_group][left_lane]);
        let right_w = from_right(w, old_z[right_group][right_lane], last);
        // Where there is no row or column, the face beside has the same speed: nothing rubs on walls.
        let along_x = Flow(u, left_u, right_u, select(low_u, u, has_low == 0.0), select(high_u, u, has_high == 0.0),
            0.5 * (qx_left + qx), 0.5 * (qx + right_qx), low_qz, right_low_qz, qz, right_qz, now.rain + 0.5 * (spring + right_spring));
        let along_z = Flow(w, low_w, high_w * has_high, select(left_w, w, has_left == vec4<f32>(0.0)), select(right_w, w, has_right == vec4<f32>(0.0)),
            0.5 * (low_qz + qz), 0.5 * (qz + high_qz * has_high), qx_left, high_qx_left, qx, high_qx, now.rain + 0.5 * (spring + high_spring));
        faces_x[at] = inside * has_right * next_speed(along_x, here_ground, here_water, right_ground, right_water, step);
        faces_z[at] = inside * has_high * next_speed(along_z, here_ground, here_water, high_ground, high_water, step);
        // A tile may sleep only when both buffers hold stillness.
        stirs += abs(u) + abs(w);
        low_u = u;
        low_w = w;
        low_qz = qz;
        low_qz_end = qz_end;
        u = high_u;
        w = high_w;
        qx = high_qx;
        qz = high_qz;
        qx_left = high_qx_left;
        spring = high_spring;
        here_water = high_water;
        here_ground = high_ground;
    }
    if any(stirs > vec4<f32>(0.0)) {
        atomicStore(&tiles[16 + tile], 1u);
    }
}
    }#
}#
