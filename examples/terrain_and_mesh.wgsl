// The host's own shader: towers of 40 by 40 by 160 metres.

struct Host {
    clip_from_world: mat4x4<f32>,
    to_sun: vec4<f32>,
    sun: vec4<f32>,
    sky: vec4<f32>,
    // Where each tower stands, from the eye [m].
    feet: array<vec4<f32>, 8>,
}

struct Point {
    @builtin(position) clip: vec4<f32>,
    @location(0) place: vec3<f32>,
}

@group(0) @binding(0) var<uniform> host: Host;

@vertex
fn tower(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Point {
    let side = index / 6u;
    let corner = index % 6u;
    let flat = 2.0 * vec2<f32>(f32((0x32u >> corner) & 1u), f32((0x2cu >> corner) & 1u)) - 1.0;
    let depth = select(-1.0, 1.0, side % 2u == 1u);
    var cube = vec3<f32>(flat, depth);
    cube = select(cube, cube.zxy, side / 2u == 1u);
    cube = select(cube, cube.yzx, side / 2u == 2u);
    // It stands some metres deep in the ground, which slants.
    let place = host.feet[instance].xyz + vec3<f32>(20.0, 80.0, 20.0) * cube + vec3<f32>(0.0, 60.0, 0.0);
    return Point(host.clip_from_world * vec4<f32>(place, 1.0), place);
}

@fragment
fn lit(in: Point) -> @location(0) vec4<f32> {
    let across = cross(dpdx(in.place), dpdy(in.place));
    let normal = faceForward(normalize(across), in.place, across);
    let irradiance = host.sun.rgb * max(dot(normal, host.to_sun.xyz), 0.0) + host.sky.rgb * (0.5 + 0.5 * normal.y);
    return vec4<f32>(vec3<f32>(0.7, 0.12, 0.08) * irradiance / 3.14159265, 1.0);
}
