After a step of erosion or an edit: the ground over the reference level, from base and change, and the least and greatest height that each strip has had. With GROUND_ALL of all tiles, else of
those that ran.

#PROGRAM{ ground_level }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, strip_of, columns_of, plane_of}

override GROUND_ALL: i32 = 0;

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(1) @binding(0) var<storage, read> change: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read_write> tiles: array<atomic<u32>>;
@group(2) @binding(0) var<storage, read_write> ground: array<vec4<f32>>;

@compute @workgroup_size(8)
fn relevel(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) id: vec3<u32>) {
    var tile = i32(id.x);
    if GROUND_ALL == 0 {
        tile = i32(atomicLoad(&tiles[16 + 2 * now.tiles + tile]));
    }
    let place = strip_of(now, tile, i32(lane));
    if place.group >= now.groups {
        return;
    }
    let plane = plane_of(now);
    var least = vec4<f32>(3e38);
    var most = vec4<f32>(-3e38);
    for (var z = place.first; z < place.end; z++) {
        let at = place.at + (z - place.first) * place.pitch;
        let base = ground[plane + at] - now.reference;
        let more = change[at];
        let height = base + more;
        ground[at] = height;
        // What rounding may have taken, so that no height is beyond.
        let slack = 2.4e-7 * (abs(base) + abs(more));
        least = min(least, height - slack);
        most = max(most, height + slack);
    }
    let inside = columns_of(place.group) < vec4<i32>(now.columns);
    let low = select(vec4<f32>(3e38), least, inside);
    let high = select(vec4<f32>(-3e38), most, inside);
    let book = 16 + 3 * now.tiles + (tile * 8 + i32(lane)) * 12;
    let lowest = min(bitcast<f32>(atomicLoad(&tiles[book + 10])), min(min(low.x, low.y), min(low.z, low.w)));
    let highest = max(bitcast<f32>(atomicLoad(&tiles[book + 11])), max(max(high.x, high.y), max(high.z, high.w)));
    atomicStore(&tiles[book + 10], bitcast<u32>(lowest));
    atomicStore(&tiles[book + 11], bitcast<u32>(highest));
}
    }#
}#
