Second half of a step of shallow water: discharges through the faces, each found alike from both sides, and the water that they move; rain, sources, evaporation, seepage; the mean.

#PROGRAM{ ground_advance }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, strip_of, place_of, row_after, plane_of, row_at, columns_of, from_left, from_right, sourced, weather, running_mean}
#import veduta::ground::shallow::{sill_depth, discharge}
#import veduta::ground::exact::{add_exactly, opaque}

// Whether there may be rain or springs.
override GROUND_FRESH: i32 = 1;

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(0) @binding(1) var<uniform> sources: mat4x4<f32>;
@group(1) @binding(0) var<storage, read> water: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read> ground: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read_write> tiles: array<atomic<u32>>;
@group(2) @binding(0) var<storage, read_write> water_after: array<vec4<f32>>;
@group(2) @binding(1) var<storage, read_write> faces_x: array<vec4<f32>>;
@group(2) @binding(2) var<storage, read_write> faces_z: array<vec4<f32>>;
@group(2) @binding(3) var<storage, read_write> means: array<vec4<f32>>;

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

fn through(speed: vec4<f32>, ground_near: vec4<f32>, near: vec4<f32>, ground_far: vec4<f32>, far: vec4<f32>) -> vec4<f32> {
    let rise = ground_far - ground_near;
    // Not fused into sums: the same number on both sides of the face, and mirrored grounds stay mirrored.
    return opaque(discharge(speed, sill_depth(near, rise), sill_depth(far, -rise)), now.none);
}

@compute @workgroup_size(8)
fn advance(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) id: vec3<u32>) {
    let tile = i32(atomicLoad(&tiles[16 + 2 * now.tiles + i32(id.x)]));
    let place = strip_of(now, tile, i32(lane));
    if place.group >= now.groups {
        return;
    }
    let step = bitcast<f32>(atomicLoad(&tiles[1]));
    let scale = step / now.spacing;
    let plane = plane_of(now);
    let columns = columns_of(place.group);
    let last = columns == vec4<i32>(now.columns - 1);
    let inside = select(vec4<f32>(0.0), vec4<f32>(1.0), columns < vec4<i32>(now.columns));
    let ends = now.boundary != 2;
    let falls = select(0.0, 1.0, now.boundary == 0);
    let at_left = select(vec4<f32>(0.0), vec4<f32>(1.0), (columns == vec4<i32>(0)) & vec4<bool>(ends));
    let at_right = select(vec4<f32>(0.0), vec4<f32>(1.0), last & vec4<bool>(ends));
    var gained = vec4<f32>(0.0);
    var evaporated = vec4<f32>(0.0);
    var seeped = vec4<f32>(0.0);
    var run_off = vec4<f32>(0.0);
    var stirs = vec4<f32>(0.0);
    var top = vec4<f32>(0.0);
    let first_at = place.at;
    let low_at = place_of(now, place.group, row_at(now, place.first - 1));
    var here_water = water[first_at];
    var here_ground = ground[first_at];
    let low_wall = place.first == 0 && ends;
    var low_w = select(faces_z[low_at], vec4<f32>(0.0), vec4<bool>(low_wall));
    var low_qz = through(low_w, ground[low_at], water[low_at], here_ground, here_water);
    for (var z = place.first; z < place.end; z++) {
        let at = place.at + (z - place.first) * place.pitch;
        let next = row_after(now, place, at, z);
        let left_at = place.left + (z - place.first) * place.left_pitch;
        let right_at = place.right + (z - place.first) * place.right_pitch;
        let high_water = water[next];
        let high_ground = ground[next];
        let u = faces_x[at];
        let w = faces_z[at];
        let right_water = from_right(here_water, water[right_at >> 2u][right_at & 3], last);
        let right_ground = from_right(here_ground, ground[right_at >> 2u][right_at & 3], last);
        let qx = through(u, here_ground, here_water, right_ground, right_water);
        let qz = through(w, here_ground, here_water, high_ground, high_water);
        let left_u = faces_x[left_at >> 2u][left_at & 3] * (1.0 - at_left.x);
        let left_q = through(vec4<f32>(left_u), vec4<f32>(ground[left_at >> 2u][left_at & 3]), vec4<f32>(water[left_at >> 2u][left_at & 3]),
            vec4<f32>(here_ground.x), vec4<f32>(here_water.x));
        let qx_left = from_left(qx, left_q.x);
        // Over open edges water falls as over a weir's crest.
        let fall = falls * here_water * min(sqrt(max(now.gravity * here_water, vec4<f32>(0.0))), vec4<f32>(0.249 / scale));
        let off = fall * ((at_left + at_right) + (select(0.0, 1.0, z == 0 && ends) + select(0.0, 1.0, z == now.rows - 1 && ends)));
        // Nothing beyond the last column, where the face of the last cell would fill the next lane.
        let more = inside * (((qx_left - qx) + (low_qz - qz)) * scale - off * scale);
        let moved = add_exactly(here_water, water[plane + at], more, now.none);
        var spring = vec4<f32>(0.0);
        if GROUND_FRESH != 0 {
            spring = sourced(sources, now.sources, columns, z);
        }
        let change = weather(now, spring, moved.value, inside, step);
        let after = add_exactly(moved.value, moved.lost, (change.gained - change.evaporated) - change.seeped, now.none);
        water_after[at] = after.value;
        water_after[plane + at] = after.lost;
        faces_x[plane + at] = qx;
        faces_z[plane + at] = qz;
        let mean_after = running_mean(means[at], after.value, now.mean_weight);
        means[at] = mean_after;
        gained += change.gained;
        evaporated += change.evaporated;
        seeped += change.seeped;
        run_off += inside * off * scale;
        stirs += abs(u) + abs(w) + abs(more) + abs(mean_after - after.value) + abs((change.gained - change.evaporated) - change.seeped);
        top = max(top, max(abs(u), abs(w)) + sqrt(max(now.gravity * after.value, vec4<f32>(0.0))));
        low_qz = qz;
        here_water = high_water;
        here_ground = high_ground;
    }
    let book = 16 + 3 * now.tiles + (tile * 8 + i32(lane)) * 12;
    note(book, total(gained));
    note(book + 2, total(evaporated));
    note(book + 4, total(seeped));
    note(book + 6, total(run_off));
    let fastest = max(max(top.x, top.y), max(top.z, top.w));
    atomicMax(&tiles[16 + now.tiles + tile], bitcast<u32>(fastest));
    if any(stirs > vec4<f32>(0.0)) {
        atomicStore(&tiles[16 + tile], 1u);
    }
}
    }#
}#
