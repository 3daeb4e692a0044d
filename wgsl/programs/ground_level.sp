After a step of erosion: the ground over the reference level, from base and change.

#PROGRAM{ ground_level }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, strip_of, row_start, plane_of}

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(1) @binding(0) var<storage, read> change: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read_write> tiles: array<atomic<u32>>;
@group(2) @binding(0) var<storage, read_write> ground: array<vec4<f32>>;

@compute @workgroup_size(8)
fn relevel(@builtin(local_invocation_index) lane: u32, @builtin(workgroup_id) id: vec3<u32>) {
    let place = strip_of(now, i32(atomicLoad(&tiles[16 + 2 * now.tiles + i32(id.x)])), i32(lane));
    if place.group >= now.groups {
        return;
    }
    let plane = plane_of(now);
    for (var z = place.first; z < place.end; z++) {
        let at = row_start(now, z) + place.column;
        ground[at] = (ground[plane + at] - now.reference) + change[at];
    }
}
    }#
}#
