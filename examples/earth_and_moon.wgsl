// What a host draws in space: stars and a Moon, as radiance with linear depth over the greatest depth in alpha.
struct Host {
    // The ray through the middle of the picture, and the distance of the Moon [m].
    middle: vec4<f32>,
    // To the right edge, and the radius of the Moon [m].
    right: vec4<f32>,
    // To the upper edge, and the greatest depth [m].
    up: vec4<f32>,
    forward: vec4<f32>,
    to_moon: vec4<f32>,
    to_sun: vec4<f32>,
    sun_irradiance: vec4<f32>,
}

@group(0) @binding(0) var<uniform> host: Host;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) ray: vec3<f32>,
}

@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let clip = vec2<f32>(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u));
    return Corner(vec4<f32>(clip, 0.0, 1.0), host.middle.xyz + clip.x * host.right.xyz + clip.y * host.up.xyz);
}

fn scrambled(x: u32) -> u32 {
    let state = x * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

@fragment
fn space(in: Corner) -> @location(0) vec4<f32> {
    let dir = normalize(in.ray);
    // Stars sit in some cells of a lattice over the sky.
    let cell = vec3<i32>(floor(dir * 260.0));
    let word = scrambled(u32(cell.x) ^ scrambled(u32(cell.y) ^ scrambled(u32(cell.z))));
    let bright = f32(word & 0xffffu) / 65536.0;
    var light = vec3<f32>(select(0.0, 0.6 * bright * bright * bright, (word >> 16u) % 90u == 0u));
    var depth = 1.0;
    // The Moon's disc, antialiased over a pixel; its lit side scatters like dark rock.
    let radius = host.right.w / host.middle.w;
    let across = cross(host.to_moon.xyz, dir);
    let off = length(across) / radius;
    let edge = max(fwidth(off), 1e-6);
    if dot(dir, host.to_moon.xyz) > 0.0 && off < 1.0 {
        let aside = (dir - host.to_moon.xyz * dot(dir, host.to_moon.xyz)) / radius;
        let normal = normalize(aside - host.to_moon.xyz * sqrt(max(1.0 - off * off, 0.0)));
        let lit = host.sun_irradiance.rgb * (0.12 * 0.31830989) * max(dot(normal, host.to_sun.xyz), 0.0);
        light = mix(light, lit, clamp((1.0 - off) / edge, 0.0, 1.0));
        depth = host.middle.w * dot(dir, host.forward.xyz) / host.up.w;
    }
    return vec4<f32>(light, depth);
}
