Before each step of the ground: which tiles run, those where something moved and their neighbours, in order; the length of the step; the clock. One workgroup.

#PROGRAM{ ground_plan }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep}

@group(0) @binding(0) var<uniform> now: GroundStep;
// 0 tiles that run, 1 step, 2 and 3 the clock and what rounding took from it, 4 steps, 5 fastest wave, 6 tiles run in all, 7 their carry; from 16 flags, fastest wave and
// the list of each tile.
@group(1) @binding(0) var<storage, read_write> tiles: array<atomic<u32>>;
@group(2) @binding(0) var<storage, read_write> arguments: array<u32>;

var<workgroup> counts: array<u32, 64>;
var<workgroup> tops: array<f32, 64>;

fn flag(x: i32, z: i32) -> u32 {
    let tiles_z = now.tiles / now.tiles_x;
    var at = vec2<i32>(x, z);
    if now.boundary == 2 {
        at = (at + vec2<i32>(now.tiles_x, tiles_z)) % vec2<i32>(now.tiles_x, tiles_z);
    }
    if any(at < vec2<i32>(0)) || at.x >= now.tiles_x || at.y >= tiles_z {
        return 0u;
    }
    return atomicLoad(&tiles[16 + at.y * now.tiles_x + at.x]);
}

fn runs(tile: i32) -> bool {
    let x = tile % now.tiles_x;
    let z = tile / now.tiles_x;
    var found = u32(now.awake);
    for (var k = 0; k < 9; k++) {
        found += flag(x + k % 3 - 1, z + k / 3 - 1);
    }
    return found > 0u;
}

@compute @workgroup_size(64)
fn plan(@builtin(local_invocation_index) lane: u32) {
    let share = (now.tiles + 63) / 64;
    let first = i32(lane) * share;
    let end = min(first + share, now.tiles);
    var count = 0u;
    var top = 0.0;
    for (var tile = first; tile < end; tile++) {
        if runs(tile) {
            count += 1u;
        }
        top = max(top, bitcast<f32>(atomicLoad(&tiles[16 + now.tiles + tile])));
    }
    counts[lane] = count;
    tops[lane] = top;
    workgroupBarrier();
    var at = 0u;
    for (var k = 0u; k < lane; k++) {
        at += counts[k];
    }
    for (var tile = first; tile < end; tile++) {
        if runs(tile) {
            atomicStore(&tiles[16 + 2 * now.tiles + i32(at)], u32(tile));
            at += 1u;
        }
    }
    storageBarrier();
    workgroupBarrier();
    var mine = 0u;
    for (var k = 0u; k <= lane; k++) {
        mine += counts[k];
    }
    for (var k = mine - counts[lane]; k < mine; k++) {
        let tile = i32(atomicLoad(&tiles[16 + 2 * now.tiles + i32(k)]));
        atomicStore(&tiles[16 + tile], 0u);
        atomicStore(&tiles[16 + now.tiles + tile], 0u);
    }
    if lane == 63u {
        for (var k = 0u; k < 63u; k++) {
            top = max(top, tops[k]);
        }
        atomicStore(&tiles[0], mine);
        arguments[0] = mine;
        arguments[1] = 1u;
        arguments[2] = 1u;
        var step = now.step;
        if step == 0.0 {
            step = min(now.most_step, now.courant * now.spacing / max(top, 1e-9));
        }
        atomicStore(&tiles[1], bitcast<u32>(step));
        let clock = bitcast<f32>(atomicLoad(&tiles[2]));
        let all = bitcast<f32>(atomicLoad(&tiles[3])) + step;
        let sum = bitcast<f32>(bitcast<u32>(clock + all) ^ now.none);
        // The clock is never behind what is added.
        atomicStore(&tiles[2], bitcast<u32>(sum));
        atomicStore(&tiles[3], bitcast<u32>(all - bitcast<f32>(bitcast<u32>(sum - clock) ^ now.none)));
        atomicStore(&tiles[4], atomicLoad(&tiles[4]) + 1u);
        atomicStore(&tiles[5], bitcast<u32>(top));
        let run = atomicLoad(&tiles[6]) + mine;
        if run < mine {
            atomicStore(&tiles[7], atomicLoad(&tiles[7]) + 1u);
        }
        atomicStore(&tiles[6], run);
    }
}
    }#
}#
