What a new ground is given over its field: a share of the relief by its shape, and an altitude.

#PROGRAM{ ground_shape }#

#COMPUTE{
    #CODE{
#import veduta::ground::shape::{bump, bed_share}

struct GroundShape {
    columns: i32,
    rows: i32,
    // 0 even, 1 hill, 2 lake, 3 valley, 4 ridge, 5 slope, 6 bed.
    shape: i32,
    // Whether the ground goes on at the other edge.
    wraps: i32,
    // Height of the shape [m].
    relief: f32,
    // Added everywhere by this pass [m].
    offset: f32,
}

@group(0) @binding(0) var<uniform> form: GroundShape;
@group(1) @binding(0) var<storage, read> before: array<f32>;
@group(2) @binding(0) var<storage, read_write> after: array<f32>;

@compute @workgroup_size(64)
fn shape(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = vec2<i32>(id.xy);
    if at.x >= form.columns {
        return;
    }
    let x = (f32(at.x) + 0.5) / f32(form.columns);
    let z = (f32(at.y) + 0.5) / f32(form.rows);
    let p = vec2<f32>(2.0 * x - 1.0, 2.0 * z - 1.0);
    var share = 0.0;
    switch form.shape {
        case 1: {
            share = bump(sqrt(p.x * p.x + p.y * p.y));
        }
        case 2: {
            share = -bump(sqrt(p.x * p.x + p.y * p.y));
        }
        case 3: {
            share = -bump(p.x);
        }
        case 4: {
            share = bump(p.x);
        }
        case 5: {
            share = -x;
        }
        case 6: {
            share = bed_share(x, z);
        }
        default: {
        }
    }
    let cell = at.y * form.columns + at.x;
    after[cell] = (before[cell] + form.relief * share) + form.offset;
}
    }#
}#
