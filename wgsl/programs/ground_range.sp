Least and greatest height over the reference level that the ground has had, from what its strips noted. One workgroup.

#PROGRAM{ ground_range }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep}

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(1) @binding(0) var<storage, read> tiles: array<u32>;
@group(2) @binding(0) var<storage, read_write> extremes: array<f32>;

var<workgroup> lowest: array<f32, 64>;
var<workgroup> highest: array<f32, 64>;

@compute @workgroup_size(64)
fn find(@builtin(local_invocation_index) lane: u32) {
    var low = 3e38;
    var high = -3e38;
    for (var strip = i32(lane); strip < 8 * now.tiles; strip += 64) {
        let book = 16 + 3 * now.tiles + 12 * strip;
        low = min(low, bitcast<f32>(tiles[book + 10]));
        high = max(high, bitcast<f32>(tiles[book + 11]));
    }
    lowest[lane] = low;
    highest[lane] = high;
    workgroupBarrier();
    if lane == 0u {
        for (var k = 1u; k < 64u; k++) {
            low = min(low, lowest[k]);
            high = max(high, highest[k]);
        }
        extremes[0] = low;
        extremes[1] = high;
    }
}
    }#
}#
