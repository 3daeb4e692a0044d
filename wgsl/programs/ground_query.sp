Height, depth, velocity and normal of the ground at given places, between cells bilinearly.

#PROGRAM{ ground_query }#

#COMPUTE{
    #CODE{
#import veduta::ground::grid::{GroundStep, cell_place, plane_of}

struct Found {
    height: f32,
    depth: f32,
    velocity: vec2<f32>,
    normal: vec3<f32>,
    spare: f32,
}

@group(0) @binding(0) var<uniform> now: GroundStep;
@group(1) @binding(0) var<storage, read> ground: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read> water: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read> speeds_x: array<vec4<f32>>;
@group(1) @binding(3) var<storage, read> speeds_z: array<vec4<f32>>;
@group(1) @binding(4) var<storage, read> places: array<vec2<f32>>;
@group(2) @binding(0) var<storage, read_write> results: array<Found>;

// Beyond the edges the other edge where they are periodic, else the edge.
fn cell(x: i32, z: i32) -> i32 {
    let size = vec2<i32>(now.columns, now.rows);
    let at = vec2<i32>(x, z);
    let p = select(clamp(at, vec2<i32>(0), size - 1), (at + size) % size, vec2<bool>(now.boundary == 2));
    return cell_place(now, p.x, p.y);
}

fn height(x: i32, z: i32) -> f32 {
    let at = cell(x, z);
    return ground[at >> 2u][at & 3];
}

// Velocity in the middle of a cell: of `Physical` the mean of its faces, of the source's scheme what leaves to either side.
fn velocity(x: i32, z: i32) -> vec2<f32> {
    let at = cell(x, z);
    let plane = plane_of(now);
    let near = vec2<f32>(speeds_x[at >> 2u][at & 3], speeds_z[at >> 2u][at & 3]);
    if now.scheme == 0 {
        return near - vec2<f32>(speeds_x[plane + (at >> 2u)][at & 3], speeds_z[plane + (at >> 2u)][at & 3]);
    }
    let l = cell(x - 1, z);
    let d = cell(x, z - 1);
    // Nothing goes through the faces before the first column and row but where they are periodic.
    let wall = vec2<bool>(x == 0, z == 0) & vec2<bool>(now.boundary != 2);
    return 0.5 * (near + select(vec2<f32>(speeds_x[l >> 2u][l & 3], speeds_z[d >> 2u][d & 3]), vec2<f32>(0.0), wall));
}

@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&places) {
        return;
    }
    let size = vec2<f32>(f32(now.columns), f32(now.rows));
    let asked = places[id.x];
    // A quotient that rounds up may leave the grid by its last place.
    let wrapped = clamp(asked - size * floor(asked / size), vec2<f32>(0.0), size);
    let p = select(clamp(asked, vec2<f32>(0.0), size - 1.0), select(wrapped, vec2<f32>(0.0), wrapped >= size), vec2<bool>(now.boundary == 2));
    let corner = vec2<i32>(floor(p));
    let f = p - floor(p);
    var found = Found(0.0, 0.0, vec2<f32>(0.0), vec3<f32>(0.0), 0.0);
    for (var k = 0; k < 4; k++) {
        let x = corner.x + (k & 1);
        let z = corner.y + (k >> 1u);
        let w = select(1.0 - f.x, f.x, (k & 1) == 1) * select(1.0 - f.y, f.y, k >= 2);
        let at = cell(x, z);
        found.height += w * ground[at >> 2u][at & 3];
        found.depth += w * water[at >> 2u][at & 3];
        found.velocity += w * velocity(x, z);
        found.normal += w * normalize(vec3<f32>(height(x - 1, z) - height(x + 1, z), 2.0 * now.spacing, height(x, z - 1) - height(x, z + 1)));
    }
    found.height += now.reference;
    found.normal = normalize(found.normal);
    results[id.x] = found;
}
    }#
}#
