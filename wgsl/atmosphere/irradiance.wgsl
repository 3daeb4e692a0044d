//! Light of the sky and the ground on a plane: a quadrature over all directions, each of which is a march through the tables of the air.
//! source   ours
//! symbols  h altitude [m] · mu zenith cosine of a direction · phi its azimuth from the sun · i number of a node
#define_import_path veduta::atmosphere::irradiance

#import veduta::atmosphere::medium::{Air}
#import veduta::atmosphere::ray::{AirRay}
#import veduta::atmosphere::columns::{horizon_cosine, sun_depth, sun_above_horizon}
#import veduta::atmosphere::diffuse::{diffuse_moments, level_irradiance}
#import veduta::atmosphere::scatter::{scatter_along, scattered_radiance}
#import veduta::math::squared::{squared_node}

/// Nodes of the quadrature over directions on one side of the sun's vertical plane: `SPOKES` azimuths of each of `ABOVE` heights above the
/// horizon and `BELOW` heights below it.
const SPOKES: i32 = 16;
const ABOVE: i32 = 16;
const BELOW: i32 = 8;

/// How many nodes there are.
const SPHERE_NODES: i32 = 384;

/// A node of the quadrature; it stands for its mirror image behind the sun's vertical plane too.
struct SphereNode {
    /// Zenith cosine.
    mu: f32,
    /// Cosine of the azimuth from the sun.
    cos_phi: f32,
    /// Solid angle of the node without its mirror image [sr].
    solid: f32,
}

/// Node number `i` of `SPHERE_NODES` around a place at altitude `h`: azimuths in equal parts, heights dense on both sides of the horizon. The solid
/// angles sum to half a sphere.
///
/// domain  ground_radius in [3e6, 1e8] m log
/// domain  h in [0, 2e5] m lin
/// domain  i in [0, 383] 1 lin
/// range   [-1, 1] 1
/// error   1e-6 abs of reference::air_tables::sphere_node
/// outside undefined
/// source  midpoints in azimuth; veduta::math::squared
fn sphere_node(ground_radius: f32, h: f32, i: i32) -> SphereNode {
    let horizon = horizon_cosine(ground_radius, h);
    let row = i / SPOKES;
    let below = row >= ABOVE;
    let polar = squared_node(select(ABOVE, BELOW, below), select(row, row - ABOVE, below));
    let span = select(1.0 - horizon, -1.0 - horizon, below);
    let phi = 3.1415927 * (f32(i - row * SPOKES) + 0.5) / f32(SPOKES);
    return SphereNode(horizon + span * polar.x, cos(phi), abs(span) * polar.y * (3.1415927 / f32(SPOKES)));
}

/// Radiance of all orders along a ray up to its end, that of the bare ground there included.
///
/// domain  angular_radius in [0, 0.1] rad lin
/// domain  steps in [1, 64] 1 lin
/// range   [0, 1e4] 1/sr
/// error   0.05 rel of reference::sky_paths::trace_sky
/// source  Lambert's ground under the sun and the moments of the sky
fn seen_radiance(columns: texture_2d_array<f32>, moments: texture_2d_array<f32>, linear: sampler, air: Air, ray: AirRay, angular_radius: f32, steps: i32) -> vec3<f32> {
    let scattered = scatter_along(columns, moments, linear, air, ray, angular_radius, true, steps);
    var light = scattered_radiance(air, scattered, ray.nu);
    if ray.meets_ground != 0u {
        let sun_mu = clamp(((air.ground_radius + ray.altitude) * ray.sun_mu + ray.length * ray.nu) / air.ground_radius, -1.0, 1.0);
        let lit = sun_above_horizon(air.ground_radius, 0.0, sun_mu, angular_radius);
        let sun = lit * max(sun_mu, 0.0) * exp(-sun_depth(columns, linear, air, 0.0, sun_mu));
        let around = level_irradiance(diffuse_moments(moments, linear, air.top, 0.0, sun_mu));
        light += scattered.transmittance * air.ground_albedo * (0.31830989 * (sun + around));
    }
    return light;
}
