Second half of a step of the source's water: water moves by the outflow speeds and takes its speed along; rain, sources, evaporation, seepage; the mean. With GROUND_EROSION also the load moves.

#PROGRAM{ ground_transport }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, strip_of, place_of, row_after, plane_of, row_at, columns_of, from_left, from_right, sourced, weather, running_mean}
#import veduta::ground::flow::{mixed_speed}
#import veduta::ground::exact::{add_exactly, opaque}

// Whether there may be rain or springs.
override GROUND_FRESH: i32 = 1;

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(0) @binding(1) var<uniform> sources: mat4x4<f32>;
@group(1) @binding(0) var<storage, read> old_x: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read> old_z: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read_write> tiles: array<atomic<u32>>;
@group(2) @binding(0) var<storage, read_write> water: array<vec4<f32>>;
@group(2) @binding(1) var<storage, read_write> speeds_x: array<vec4<f32>>;
@group(2) @binding(2) var<storage, read_write> speeds_z: array<vec4<f32>>;
@group(2) @binding(3) var<storage, read_write> means: array<vec4<f32>>;
#ifdef GROUND_EROSION
@group(2) @binding(4) var<storage, read_write> load: array<vec4<f32>>;
#endif

// What came and went, summed by strip with what rounding took.
fn note(place: i32, more: f32) {
    let had = bitcast<f32>(atomicLoad(&tiles[place]));
    let pair = add_exactly(vec4<f32>(had), vec4<f32>(bitcast<f32>(atomicLoad(&tiles[place + 1]))), vec4<f32>(more), now.none);
    atomicStore(&tiles[place], bitcast<u32>(pair.value.x));
    atomicStore(&tiles[place + 1], bitcast<u32>(pair.lost.x));
}

fn total(v: vec4<f32>) -> f32 {
    return (v.x + v.y) + (v.z + v.w);
}

@compute @workgroup_size(8)
fn transport(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) id: vec3<u32>) {
    let tile = i32(atomicLoad(&tiles[16 + 2 * now.tiles + i32(id.x)]));
    let place = strip_of(now, tile, i32(lane));
    if place.group >= now.groups {
        return;
    }
    let step = now.step;
    let plane = plane_of(now);
    let columns = columns_of(place.group);
    let last = columns == vec4<i32>(now.columns - 1);
    let inside = select(vec4<f32>(0.0), vec4<f32>(1.0), columns < vec4<i32>(now.columns));
    let ends = now.boundary != 2;
    let has_left = inside * select(vec4<f32>(1.0), vec4<f32>(0.0), (columns == vec4<i32>(0)) & vec4<bool>(ends));
    let has_right = inside * select(vec4<f32>(1.0), vec4<f32>(0.0), last & vec4<bool>(ends));
    var gained = vec4<f32>(0.0);
    var evaporated = vec4<f32>(0.0);
    var seeped = vec4<f32>(0.0);
    var run_off = vec4<f32>(0.0);
    var load_off = vec4<f32>(0.0);
    var stirs = vec4<f32>(0.0);
    let low_start = place_of(now, place.group, row_at(now, place.first - 1));
    let at_start = place.at;
    var low_up = old_z[low_start];
    var up = old_z[at_start];
    var down = old_z[plane + at_start];
#ifdef GROUND_EROSION
    var low_load = means[plane + low_start];
    var here_load = means[plane + at_start];
#endif
    for (var z = place.first; z < place.end; z++) {
        let at = place.at + (z - place.first) * place.pitch;
        let next = row_after(now, place, at, z);
        let high_up = old_z[next];
        let high_down = old_z[plane + next];
        let has_low = select(1.0, 0.0, z == 0 && ends);
        let has_high = select(1.0, 0.0, z == now.rows - 1 && ends);
        let right = old_x[at];
        let left = old_x[plane + at];
        let left_at = place.left + (z - place.first) * place.left_pitch;
        let right_at = place.right + (z - place.first) * place.right_pitch;
        // Speeds that arrive, by the direction that they have.
        let in_right = has_left * from_left(right, old_x[left_at >> 2u][left_at & 3]);
        let in_left = has_right * from_right(left, old_x[plane + (right_at >> 2u)][right_at & 3], last);
        let in_up = has_low * low_up;
        let in_down = has_high * high_down;
        let out = opaque(((right + left) + (up + down)) * step, now.none);
        let arriving = opaque((opaque(in_right + in_left, now.none) + opaque(in_up + in_down, now.none)) * step, now.none);
        let before = water[at];
        // Where all that may leave leaves, what stays is known better than the difference says.
        let kept = select(max(before - out, vec4<f32>(0.0)), before * 1e-6, out >= before * 0.999998);
        let moved = add_exactly(before, water[plane + at], arriving - out, now.none);
        var spring = vec4<f32>(0.0);
        if GROUND_FRESH != 0 {
            spring = sourced(sources, now.sources, columns, z);
        }
        let change = weather(now, spring, moved.value, inside, step);
        let after = add_exactly(moved.value, moved.lost, (change.gained - change.evaporated) - change.seeped, now.none);
        water[at] = after.value;
        water[plane + at] = after.lost;
        let share = step * now.momentum;
        let right_after = mixed_speed(right, kept, in_right, opaque(in_right * share, now.none));
        let left_after = mixed_speed(left, kept, in_left, opaque(in_left * share, now.none));
        let up_after = mixed_speed(up, kept, in_up, opaque(in_up * share, now.none));
        let down_after = mixed_speed(down, kept, in_down, opaque(in_down * share, now.none));
        let mixes = vec4<bool>(now.momentum > 0.0);
        speeds_x[at] = select(right, right_after, mixes);
        speeds_x[plane + at] = select(left, left_after, mixes);
        speeds_z[at] = select(up, up_after, mixes);
        speeds_z[plane + at] = select(down, down_after, mixes);
        let mean = means[at];
        let mean_after = running_mean(mean, after.value, now.mean_weight);
        means[at] = mean_after;
        gained += change.gained;
        evaporated += change.evaporated;
        seeped += change.seeped;
        let off = ((right * (1.0 - has_right) + left * (1.0 - has_left)) + (up * (1.0 - has_high) + down * (1.0 - has_low))) * step;
        run_off += off;
        stirs += (out + arriving) + abs(mean_after - after.value) + abs((change.gained - change.evaporated) - change.seeped);
#ifdef GROUND_EROSION
        let high_load = means[plane + next];
        let load_right = opaque(in_right * from_left(here_load, means[plane + (left_at >> 2u)][left_at & 3]), now.none);
        let load_left = opaque(in_left * from_right(here_load, means[plane + (right_at >> 2u)][right_at & 3], last), now.none);
        let brought = ((load_right + load_left) + (opaque(in_up * low_load, now.none) + opaque(in_down * high_load, now.none))) * step;
        let carried = add_exactly(load[at], load[plane + at], brought - here_load * out, now.none);
        load[at] = carried.value;
        load[plane + at] = carried.lost;
        load_off += here_load * off;
        low_load = here_load;
        here_load = high_load;
#endif
        low_up = up;
        up = high_up;
        down = high_down;
    }
    let book = 16 + 3 * now.tiles + (tile * 8 + i32(lane)) * 12;
    note(book, total(gained));
    note(book + 2, total(evaporated));
    note(book + 4, total(seeped));
    note(book + 6, total(run_off));
    note(book + 8, total(load_off));
    if any(stirs > vec4<f32>(0.0)) {
        atomicStore(&tiles[16 + tile], 1u);
    }
}
    }#
}#
