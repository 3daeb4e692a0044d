// The host's own shader: a round piece of the planet with hills and far mountains, and a few boxes.

struct Host {
    clip_from_world: mat4x4<f32>,
    // w is the altitude of the eye [m].
    to_sun: vec4<f32>,
    sun: vec4<f32>,
    sky: vec4<f32>,
}

struct Point {
    @builtin(position) clip: vec4<f32>,
    @location(0) place: vec3<f32>,
    @location(1) albedo: vec3<f32>,
}

@group(0) @binding(0) var<uniform> host: Host;

const RADIUS: f32 = 6360000.0;

// From a place on the map and a height to the eye's frame.
fn on_planet(map: vec2<f32>, height: f32) -> vec3<f32> {
    let away = max(length(map), 1e-3);
    let half = sin(0.5 * away / RADIUS);
    let aside = (RADIUS + height) * sin(away / RADIUS) / away * map;
    return vec3<f32>(aside.x, height - 2.0 * (RADIUS + height) * half * half - host.to_sun.w, aside.y);
}

fn corner_of(index: u32) -> vec2<f32> {
    return vec2<f32>(f32((0x32u >> index) & 1u), f32((0x2cu >> index) & 1u));
}

// 160 rings of 320 sectors.
@vertex
fn ground(@builtin(vertex_index) index: u32) -> Point {
    let cell = vec2<u32>(index / 6u / 320u, (index / 6u) % 320u);
    let at = vec2<f32>(cell) + corner_of(index % 6u);
    let away = 1800000.0 * pow(at.x / 160.0, 3.0);
    let angle = at.y / 320.0 * 6.2831853;
    let map = away * vec2<f32>(sin(angle), cos(angle));
    let range = smoothstep(45000.0, 60000.0, away) * (1.0 - smoothstep(65000.0, 90000.0, away));
    let peaks = 4500.0 * range * abs(sin(23.0 * angle) * cos(9.0 * angle));
    let height = peaks + 60.0 * smoothstep(500.0, 5000.0, away) * (1.0 + sin(map.x / 900.0) * cos(map.y / 700.0));
    let place = on_planet(map, height);
    let snow = smoothstep(1500.0, 2500.0, height);
    return Point(host.clip_from_world * vec4<f32>(place, 1.0), place, mix(vec3<f32>(0.10, 0.13, 0.06), vec3<f32>(0.8), snow));
}

@vertex
fn boxes(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Point {
    let side = index / 6u;
    let flat = 2.0 * corner_of(index % 6u) - 1.0;
    let depth = select(-1.0, 1.0, side % 2u == 1u);
    var cube = vec3<f32>(flat, depth);
    cube = select(cube, cube.zxy, side / 2u == 1u);
    cube = select(cube, cube.yzx, side / 2u == 2u);
    // Each as large in the picture as the one before, but three times as far.
    let size = 8.0 * pow(3.0, f32(instance));
    let map = vec2<f32>(size * (2.5 * f32(instance) - 6.0), -10.0 * size) + size * cube.xz;
    let place = on_planet(map, size * (1.0 + cube.y));
    return Point(host.clip_from_world * vec4<f32>(place, 1.0), place, vec3<f32>(0.6, 0.25, 0.15));
}

@fragment
fn lit(in: Point) -> @location(0) vec4<f32> {
    let across = cross(dpdx(in.place), dpdy(in.place));
    let normal = faceForward(normalize(across), in.place, across);
    // Sunlight straight, skylight from above.
    let irradiance = host.sun.rgb * max(dot(normal, host.to_sun.xyz), 0.0) + host.sky.rgb * (0.5 + 0.5 * normal.y);
    return vec4<f32>(in.albedo * irradiance / 3.14159265, 1.0);
}
