Light in a cube of any density, or in a layer that repeats, a query: depths towards the sun, light of all orders by sweeps of discrete directions over cells, and the
march along rays. Everything lies in storage buffers, so that densities keep their 32 bits. One invocation a node, a cell, a ray; the sweep has a
workgroup a direction, which goes from plane to plane.

The phase function is split in two: a part of four degrees that turns light, of which the cells hold all orders, and the peak that hardly does, whose
orders a table of depth and angle holds.

#PROGRAM{ cloud_volume }#

#COMPUTE{
    #CODE{
#import veduta::clouds::harmonics::{Harmonics, harmonics}
#import veduta::clouds::integral::{mean_density, step_light}
#import veduta::lighting::phase::{phase_henyey_greenstein}
#ifdef CLOUD_LAYERED
#ifdef CLOUD_WINDOW
#import veduta::clouds::code::{tile_value}
#else
#import veduta::clouds::tile::{CloudTile, tile_at}
#endif
#import veduta::planet::shell::{shell_segment, clip_segment, segment_length, segment_distance, altitude_along, ground_distance, direction_cosine_along}
#endif
#ifdef CLOUD_PUBLISH
#import veduta::math::half::{half_word, word_halves}
#else
#import veduta::math::half::{half_word}
#endif
#import veduta::math::series::{one_minus_exp, one_minus_exp_over_x}

struct CloudGrid {
    // Cells of the light of many orders.
    cells: vec3<i32>,
    // Edge of the cube [m].
    size: f32,
    // Values of the density.
    voxels: vec3<i32>,
    // Extinction at a density of 1 [1/m].
    extinction: f32,
    // Nodes of the depth towards the sun, on each axis.
    nodes: i32,
    albedo: f32,
    g: f32,
    // Share of the peak in the phase function.
    peak: f32,
    to_sun: vec3<f32>,
    // Irradiance of the sun; 0 for the last gathering, which leaves its own light out.
    sun: f32,
    // Albedo times moment of the degrees 0 to 3 of the phase function without its peak.
    degrees: vec4<f32>,
    // Radiance that comes from every free direction.
    uniform_light: f32,
    // Largest step along a ray over the edge of the cube, and of its march to the sun.
    step: f32,
    // Largest depth of a step, while it is longer than a thirtieth of the largest.
    step_depth: f32,
    // Whether light of all orders is asked for.
    all_orders: i32,
    count: i32,
    coarse: vec3<i32>,
    // Of a layer, whose free directions are those above: radiance that comes from below.
    below: f32,
    shear: vec2<f32>,
    bottom: f32,
    thickness: f32,
    ground_radius: f32,
    levels: f32,
    // The first cell that is filled, the first direction that is swept.
    first: i32,
    // What a step towards the next order is taken by, and how far the step before is gone on with.
    gain: f32,
    momentum: f32,
    // The least density that the tile tells.
    least: f32,
    // How far a texel goes to what it is to be.
    ease: f32,
    // Of a stack of windows: which of its places is read, and how many it has.
    slot: f32,
    slots: f32,
}

@group(0) @binding(0) var<uniform> grid: CloudGrid;

#ifdef CLOUD_LAYERED
@group(1) @binding(0) var linear: sampler;
@group(1) @binding(1) var tile: texture_3d<f32>;

// A layer's cells repeat along x and z.
fn cell_index(at: vec3<i32>, n: vec3<i32>) -> i32 {
    let k = vec3<i32>((at.x + n.x) % n.x, clamp(at.y, 0, n.y - 1), (at.z + n.z) % n.z);
    return (k.z * n.y + k.y) * n.x + k.x;
}

#ifdef CLOUD_WINDOW
// Columns follow the sun's rays about the middle of the layer.
fn sampled(relative: vec2<f32>, altitude: f32) -> vec2<f32> {
    let above = clamp(altitude - grid.bottom, 0.0, grid.thickness);
    let place = (relative - grid.shear * (above - 0.5 * grid.thickness)) / grid.size;
    let level = (grid.slot * grid.levels + above / max(grid.thickness, 1e-3) * (grid.levels - 1.0) + 0.5) / (grid.levels * grid.slots);
    return tile_value(textureSampleLevel(tile, linear, vec3<f32>(place, level), 0.0).xy, grid.least);
}
#else
fn sampled(relative: vec2<f32>, altitude: f32) -> vec2<f32> {
    let layer = CloudTile(vec2<f32>(0.0), grid.shear, vec2<f32>(0.0), 1.0 / grid.size, grid.bottom, grid.thickness, grid.levels, grid.extinction, 0.0, grid.least);
    return tile_at(tile, linear, layer, relative, altitude);
}
#endif
#else
fn cell_index(at: vec3<i32>, n: vec3<i32>) -> i32 {
    let k = clamp(at, vec3<i32>(0), n - 1);
    return (k.z * n.y + k.y) * n.x + k.x;
}

@group(1) @binding(0) var<storage, read> density: array<f32>;

fn voxel(at: vec3<i32>) -> f32 {
    let k = clamp(at, vec3<i32>(0), grid.voxels - 1);
    return density[(k.z * grid.voxels.y + k.y) * grid.voxels.x + k.x];
}

// Density at a point of the unit cube, linear between the centres of voxels.
fn density_at(point: vec3<f32>) -> f32 {
    let q = point * vec3<f32>(grid.voxels) - 0.5;
    let base = floor(q);
    let f = q - base;
    let k = vec3<i32>(base);
    let near = mix(mix(voxel(k), voxel(k + vec3<i32>(1, 0, 0)), f.x), mix(voxel(k + vec3<i32>(0, 1, 0)), voxel(k + vec3<i32>(1, 1, 0)), f.x), f.y);
    let far = mix(mix(voxel(k + vec3<i32>(0, 0, 1)), voxel(k + vec3<i32>(1, 0, 1)), f.x), mix(voxel(k + vec3<i32>(0, 1, 1)), voxel(k + vec3<i32>(1, 1, 1)), f.x), f.y);
    return mix(near, far, f.z);
}

// Distances at which a ray enters and leaves the unit cube; the second is below the first where it misses.
fn cube_span(origin: vec3<f32>, dir: vec3<f32>) -> vec2<f32> {
    let d = select(dir, vec3<f32>(1e-9), abs(dir) < vec3<f32>(1e-9));
    let a = -origin / d;
    let b = (1.0 - origin) / d;
    let low = min(a, b);
    let high = max(a, b);
    return vec2<f32>(max(max(low.x, low.y), low.z), min(min(high.x, high.y), high.z));
}

fn marched_depth(point: vec3<f32>) -> f32 {
    let far = max(cube_span(point, grid.to_sun).y, 0.0);
    let count = clamp(i32(ceil(far / grid.step)), 1, 150);
    let ds = far / f32(count);
    var sum = 0.0;
    for (var i = 0; i < count; i++) {
        sum += density_at(point + grid.to_sun * ((f32(i) + 0.5) * ds));
    }
    return sum * ds * grid.size * grid.extinction;
}

@group(1) @binding(1) var<storage, read> nodes: array<f32>;

fn node(at: vec3<i32>) -> f32 {
    return nodes[(at.z * grid.nodes + at.y) * grid.nodes + at.x];
}

fn baked_depth(point: vec3<f32>) -> f32 {
    let q = clamp(point, vec3<f32>(0.0), vec3<f32>(1.0)) * f32(grid.nodes - 1);
    let base = min(floor(q), vec3<f32>(f32(grid.nodes - 2)));
    let f = q - base;
    let k = vec3<i32>(base);
    let near = mix(mix(node(k), node(k + vec3<i32>(1, 0, 0)), f.x), mix(node(k + vec3<i32>(0, 1, 0)), node(k + vec3<i32>(1, 1, 0)), f.x), f.y);
    let far = mix(mix(node(k + vec3<i32>(0, 0, 1)), node(k + vec3<i32>(1, 0, 1)), f.x), mix(node(k + vec3<i32>(0, 1, 1)), node(k + vec3<i32>(1, 1, 1)), f.x), f.y);
    return mix(near, far, f.z);
}

@group(2) @binding(0) var<storage, read_write> depths: array<f32>;
#endif

// Extinction without the peak [1/m] and the mean of the sun's light over what there is in the cell.
@group(2) @binding(1) var<storage, read_write> filled: array<vec2<f32>>;

// Of each direction, as bits: its sixteen harmonics; the cells along the axis of the sweep and across it, and the sense of the sweep; the strides;
// where the ray comes from in the plane before, in cells, and the way from there [m].
struct Ways {
    all: array<vec4<u32>, 168>,
}

@group(0) @binding(1) var<uniform> ways: Ways;

struct Way {
    zeroth: vec4<f32>,
    second: vec4<f32>,
    middle: vec4<f32>,
    third: vec4<f32>,
    counts: vec4<i32>,
    strides: vec4<i32>,
    shift: vec3<f32>,
}

const WAYS: i32 = 24;

fn way_part(at: i32) -> vec4<f32> {
    return bitcast<vec4<f32>>(ways.all[at]);
}

fn way_of(j: i32) -> Way {
    let at = 7 * j;
    return Way(way_part(at), way_part(at + 1), way_part(at + 2), way_part(at + 3), vec4<i32>(ways.all[at + 4]), vec4<i32>(ways.all[at + 5]), way_part(at + 6).xyz);
}

@group(1) @binding(3) var<storage, read> cells: array<vec2<f32>>;
@group(1) @binding(4) var<storage, read> source: array<f32>;
@group(2) @binding(2) var<storage, read_write> radiance: array<f32>;
@group(2) @binding(6) var<storage, read_write> faces: array<f32>;

@group(1) @binding(5) var<storage, read> arrived: array<f32>;
@group(1) @binding(6) var<storage, read> coarser: array<vec4<f32>>;
@group(2) @binding(3) var<storage, read_write> sent: array<f32>;
@group(2) @binding(4) var<storage, read_write> found_moments: array<vec4<f32>>;
// Those of the step before.
@group(2) @binding(8) var<storage, read_write> last_moments: array<vec4<f32>>;

struct CubeRay {
    origin: vec3<f32>,
    dir: vec3<f32>,
}

struct CubeLight {
    scatter: f32,
    transmittance: f32,
}

@group(1) @binding(7) var<storage, read> rays: array<CubeRay>;
// Rows of angles, columns of depths.
@group(1) @binding(8) var<storage, read> peaks: array<f32>;
@group(1) @binding(9) var<storage, read> moments: array<vec4<f32>>;
@group(2) @binding(5) var<storage, read_write> results: array<CubeLight>;

const PEAK_ANGLES: i32 = 128;
const PEAK_DEPTHS: i32 = 64;

// Light that the peak has scattered at least once, over what it leaves of the sun's: angles in squares, depths in squares up to 64.
fn peak_light(angle: f32, depth: f32) -> f32 {
    let x = clamp(sqrt(angle * 0.31830989), 0.0, 1.0) * f32(PEAK_ANGLES - 1);
    let y = clamp(sqrt(depth / 64.0), 0.0, 1.0) * f32(PEAK_DEPTHS - 1);
    let i = min(i32(x), PEAK_ANGLES - 2);
    let j = min(i32(y), PEAK_DEPTHS - 2);
    let at = i * PEAK_DEPTHS + j;
    let fy = y - f32(j);
    return mix(mix(peaks[at], peaks[at + 1], fy), mix(peaks[at + PEAK_DEPTHS], peaks[at + PEAK_DEPTHS + 1], fy), x - f32(i));
}

// What the cells scatter into the view.
fn diffuse_source(point: vec3<f32>, view: Harmonics) -> f32 {
    let q = point * vec3<f32>(grid.cells) - 0.5;
    let base = floor(q);
    let f = q - base;
    var sum = 0.0;
    for (var j = 0; j < 8; j++) {
        let offset = vec3<i32>(j & 1, (j >> 1u) & 1, j >> 2u);
        let w = select(1.0 - f, f, offset == vec3<i32>(1));
        let at = 4 * cell_index(vec3<i32>(base) + offset, grid.cells);
        sum += w.x * w.y * w.z * (dot(moments[at], view.zeroth) + dot(moments[at + 1], view.second) + dot(moments[at + 2], view.middle) + dot(moments[at + 3], view.third));
    }
    return max(sum, 0.0);
}

#ifndef CLOUD_LAYERED
fn depth_to_sun(point: vec3<f32>) -> f32 {
#ifdef CLOUD_READS_NODES
    return baked_depth(point);
#else
    return marched_depth(point);
#endif
}
#endif

#ifdef CLOUD_NODES
@compute @workgroup_size(64)
fn find_depths(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = grid.nodes;
    let i = i32(id.x);
    if i >= n * n * n {
        return;
    }
    let at = vec3<f32>(vec3<i32>(i % n, (i / n) % n, i / (n * n))) / f32(n - 1);
    depths[i] = marched_depth(at);
}
#else
#ifdef CLOUD_CELLS
@compute @workgroup_size(64)
fn fill(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = grid.cells;
    let i = i32(id.x) + grid.first;
    if i >= n.x * n.y * n.z {
        return;
    }
    let corner = vec3<f32>(vec3<i32>(i % n.x, (i / n.x) % n.y, i / (n.x * n.y)));
    let kept = 1.0 - grid.albedo * grid.peak;
    var sum = 0.0;
    var lit = 0.0;
    for (var j = 0; j < 64; j++) {
        let part = (vec3<f32>(f32(j & 3), f32((j >> 2u) & 3), f32(j >> 4u)) + 0.5) * 0.25;
        let point = (corner + part) / vec3<f32>(n);
#ifdef CLOUD_LAYERED
        let found = sampled(grid.size * point.xz, grid.bottom + grid.thickness * point.y);
        let rho = max(found.x, 0.0);
        let toward = found.y;
#else
        let rho = density_at(point);
        let toward = baked_depth(point);
#endif
        sum += rho;
        lit += rho * exp(-kept * toward);
    }
    filled[i] = vec2<f32>(kept * grid.extinction * sum / 64.0, lit / max(sum, 1e-30));
}
#else
#ifdef CLOUD_SWEEP
@compute @workgroup_size(256)
fn sweep(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let number = i32(group.x) + grid.first;
    let way = way_of(number);
    let all = grid.cells.x * grid.cells.y * grid.cells.z;
    let start = number * all;
    let down = floor(way.shift.xy);
    let part = way.shift.xy - down;
#ifdef CLOUD_LAYERED
    // Within one period, so that one comparison wraps a neighbour.
    let across = vec2<f32>(way.counts.yz);
    let first = vec2<i32>(down - across * floor((down + 0.5) / across));
#else
    let first = vec2<i32>(down);
#endif
    let plane_cells = way.counts.y * way.counts.z;
#ifdef CLOUD_LAYERED
    // Light goes from face to face through cells of even density and source, from level to level; cells keep the mean of what goes through them.
    let outside = select(grid.below, grid.uniform_light, way.counts.w < 0);
    for (var plane = 0; plane < way.counts.x; plane++) {
        let k = select(plane, way.counts.x - 1 - plane, way.counts.w < 0);
        // Faces of two levels are kept, in turns.
        let here_faces = (2 * number + (plane & 1)) * plane_cells;
        let before = (2 * number + 1 - (plane & 1)) * plane_cells;
        for (var c = i32(lane); c < plane_cells; c += 256) {
            // Without a division of integers, which is slow; exact for so few cells.
            let b = i32((f32(c) + 0.5) / f32(way.counts.y));
            let a = c - b * way.counts.y;
            let here = k * way.strides.x + a * way.strides.y + b * way.strides.z;
            var arriving = outside;
            if plane > 0 {
                let low = vec2<i32>(a, b) + first;
                let next = low + 1;
                let n = way.counts.yz;
                let wa = vec2<i32>(select(low.x, low.x - n.x, low.x >= n.x), select(next.x, next.x - n.x, next.x >= n.x)) + before;
                let wb = vec2<i32>(select(low.y, low.y - n.y, low.y >= n.y), select(next.y, next.y - n.y, next.y >= n.y)) * n.x;
                arriving = mix(mix(faces[wa.x + wb.x], faces[wa.y + wb.x], part.x), mix(faces[wa.x + wb.y], faces[wa.y + wb.y], part.x), part.y);
            }
            let own = source[start + here];
            let depth = cells[here].x * way.shift.z;
            faces[here_faces + c] = own + (arriving - own) * exp(-depth);
            radiance[start + here] = own + (arriving - own) * one_minus_exp_over_x(depth);
        }
        storageBarrier();
    }
}
#else
    for (var plane = 0; plane < way.counts.x; plane++) {
        let k = select(plane, way.counts.x - 1 - plane, way.counts.w < 0);
        let before = k - way.counts.w;
        let has_before = before >= 0 && before < way.counts.x;
        for (var c = i32(lane); c < plane_cells; c += 256) {
            // Without a division of integers, which is slow; exact for so few cells.
            let b = i32((f32(c) + 0.5) / f32(way.counts.y));
            let a = c - b * way.counts.y;
            let here = k * way.strides.x + a * way.strides.y + b * way.strides.z;
            var sigma = 0.0;
            var emitted = 0.0;
            var arriving = 0.0;
            for (var j = 0; j < 4; j++) {
                let ja = j & 1;
                let jb = j >> 1u;
                let ka = a + first.x + ja;
                let kb = b + first.y + jb;
                let weight = select(1.0 - part.x, part.x, ja == 1) * select(1.0 - part.y, part.y, jb == 1);
                let inside = has_before && ka >= 0 && ka < way.counts.y && kb >= 0 && kb < way.counts.z;
                let at = select(here, before * way.strides.x + ka * way.strides.y + kb * way.strides.z, inside);
                let outside = grid.uniform_light;
                let thickness = select(0.0, weight * cells[at].x, inside);
                sigma += thickness;
                emitted += thickness * source[start + at];
                arriving += weight * select(outside, radiance[start + at], inside);
            }
            let own = source[start + here];
            let upstream = select(own, emitted / max(sigma, 1e-30), sigma > 1e-30);
            let depth = 0.5 * (sigma + cells[here].x) * way.shift.z;
            let left = exp(-depth);
            let mean = one_minus_exp_over_x(depth);
            radiance[start + here] = arriving * left + upstream * (mean - left) + own * (1.0 - mean);
        }
        storageBarrier();
    }
}
#endif
#else
#ifdef CLOUD_GATHER
#ifndef CLOUD_PROLONG
// The next guess from what the last one gives: a step that is longer than that, and some of the step before (Polyak's heavy ball).
fn gone_on(at: i32, given: vec4<f32>) -> vec4<f32> {
    let held = found_moments[at];
    let next = held + grid.gain * (given - held) + grid.momentum * (held - last_moments[at]);
    last_moments[at] = held;
    return next;
}
#endif

// What a cell scatters into each direction, from what comes to it and from the sun.
@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = grid.cells;
    let i = i32(id.x);
    let all = n.x * n.y * n.z;
    if i >= all {
        return;
    }
    var sum = Harmonics(vec4<f32>(0.0), vec4<f32>(0.0), vec4<f32>(0.0), vec4<f32>(0.0));
    let d = grid.degrees;
    let d_zeroth = vec4<f32>(d.x, d.y, d.y, d.y);
    let d_middle = vec4<f32>(d.z, d.w, d.w, d.w);
#ifdef CLOUD_PROLONG
    let place = vec3<f32>(vec3<i32>(i % n.x, (i / n.x) % n.y, i / (n.x * n.y))) + 0.5;
    let q = place / vec3<f32>(n) * vec3<f32>(grid.coarse) - 0.5;
    let base = floor(q);
    for (var j = 0; j < 8; j++) {
        let offset = vec3<i32>(j & 1, (j >> 1u) & 1, j >> 2u);
        let f = q - base;
        let w = select(1.0 - f, f, offset == vec3<i32>(1));
        let weight = w.x * w.y * w.z;
        let at = 4 * cell_index(vec3<i32>(base) + offset, grid.coarse);
        sum.zeroth += weight * coarser[at];
        sum.second += weight * coarser[at + 1];
        sum.middle += weight * coarser[at + 2];
        sum.third += weight * coarser[at + 3];
    }
#else
    let share = 12.566371 / f32(WAYS);
    for (var j = 0; j < WAYS; j++) {
        let at = 7 * j;
        let light = share * arrived[j * all + i];
        sum.zeroth += light * way_part(at);
        sum.second += light * way_part(at + 1);
        sum.middle += light * way_part(at + 2);
        sum.third += light * way_part(at + 3);
    }
    sum.zeroth = gone_on(4 * i, sum.zeroth * d_zeroth);
    sum.second = gone_on(4 * i + 1, sum.second * d.z);
    sum.middle = gone_on(4 * i + 2, sum.middle * d_middle);
    sum.third = gone_on(4 * i + 3, sum.third * d.w);
#endif
    found_moments[4 * i] = sum.zeroth;
    found_moments[4 * i + 1] = sum.second;
    found_moments[4 * i + 2] = sum.middle;
    found_moments[4 * i + 3] = sum.third;
#ifdef CLOUD_PROLONG
    last_moments[4 * i] = sum.zeroth;
    last_moments[4 * i + 1] = sum.second;
    last_moments[4 * i + 2] = sum.middle;
    last_moments[4 * i + 3] = sum.third;
#endif
    let straight = harmonics(-grid.to_sun);
    let lit = grid.sun * cells[i].y;
    sum.zeroth += lit * d_zeroth * straight.zeroth;
    sum.second += lit * d.z * straight.second;
    sum.middle += lit * d_middle * straight.middle;
    sum.third += lit * d.w * straight.third;
    for (var j = 0; j < WAYS; j++) {
        let at = 7 * j;
        sent[j * all + i] = dot(sum.zeroth, way_part(at)) + dot(sum.second, way_part(at + 1)) + dot(sum.middle, way_part(at + 2)) + dot(sum.third, way_part(at + 3));
    }
}
#else
#ifdef CLOUD_PUBLISH
// Moments of what cells scatter of the light from above and from below; of the sun's in `moments`.
@group(1) @binding(10) var<storage, read> from_above: array<vec4<f32>>;
@group(1) @binding(11) var<storage, read> from_below: array<vec4<f32>>;
@group(2) @binding(7) var<storage, read_write> texels: array<vec2<u32>>;

// A texel that has gone on to what it is to be, so that light that a frame has found does not appear in one.
fn eased(held: vec2<u32>, found: vec4<f32>) -> vec2<u32> {
    let now = mix(vec4<f32>(word_halves(held.x), word_halves(held.y)), found, grid.ease);
    return vec2<u32>(half_word(now.xy), half_word(now.zw));
}

#ifdef CLOUD_WINDOW
// The mean of a level, of cells by what is in them; a level a row of 256 bytes.
@compute @workgroup_size(64)
fn average(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = grid.cells;
    let level = i32(id.x);
    if level >= n.y {
        return;
    }
    var sum = vec4<f32>(0.0);
    var total = 0.0;
    for (var k = 0; k < n.x * n.z; k++) {
        let i = ((k / n.x) * n.y + level) * n.x + k % n.x;
        let found = moments[4 * i];
        let along = -0.48860251 * dot(found.wyz, grid.to_sun);
        let even = 0.28209479 * vec3<f32>(found.x, from_above[4 * i].x, from_below[4 * i].x);
        // Of a level without clouds the plain mean.
        let weight = cells[i].x + 1e-9;
        sum += weight * vec4<f32>(even.x, along, even.yz);
        total += weight;
    }
    let mean = sum / total;
    texels[32 * level] = eased(texels[32 * level], mean);
}
#else
// A texel a cell: what it scatters of the sun's light evenly, and for each unit of the cosine between view and sun; of the light from above, and from below.
@compute @workgroup_size(64)
fn publish(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = grid.cells;
    let i = i32(id.x);
    if i >= n.x * n.y * n.z {
        return;
    }
    let found = moments[4 * i];
    let along = -0.48860251 * dot(found.wyz, grid.to_sun);
    let even = 0.28209479 * vec3<f32>(found.x, from_above[4 * i].x, from_below[4 * i].x);
    let at = vec3<i32>(i % n.x, (i / n.x) % n.y, i / (n.x * n.y));
    texels[(at.y * n.z + at.z) * n.x + at.x] = eased(texels[(at.y * n.z + at.z) * n.x + at.x], vec4<f32>(even.x, along, even.yz));
}
#endif
#else
#ifdef CLOUD_LAYERED
@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if i32(id.x) >= grid.count {
        return;
    }
    let dir = rays[id.x].dir;
    let eye = rays[id.x].origin.x;
    let ground = ground_distance(grid.ground_radius, eye, dir.y);
    let end = rays[id.x].origin.y;
    let segment = clip_segment(shell_segment(grid.ground_radius, grid.bottom, grid.bottom + grid.thickness, eye, dir.y), select(end, min(end, ground), ground >= 0.0));
    let size = segment_length(segment);
    let nu = clamp(dot(dir, grid.to_sun), -1.0, 1.0);
    let angle = acos(nu);
    let kept = 1.0 - grid.albedo * grid.peak;
    let view = harmonics(-dir);
    let straight = harmonics(-grid.to_sun);
    let d = grid.degrees;
    let turned = dot(vec4<f32>(d.x, d.y, d.y, d.y) * straight.zeroth, view.zeroth) + d.z * dot(straight.second, view.second)
        + dot(vec4<f32>(d.z, d.w, d.w, d.w) * straight.middle, view.middle) + d.w * dot(straight.third, view.third);
    let ds = max(size / 1500.0, grid.step);
    var depth = 0.0;
    var scatter = 0.0;
    var s = 0.0;
    var t = segment_distance(segment, 0.0);
    var here = sampled(dir.xz * t, altitude_along(grid.ground_radius, eye, dir.y, t));
    for (var i = 0; i < 1502 && s < size && kept * depth < 14.0; i++) {
        s = min(s + ds, size);
        let at = segment_distance(segment, s);
        let altitude = altitude_along(grid.ground_radius, eye, dir.y, at);
        let next = sampled(dir.xz * at, altitude);
        let added = mean_density(here.x, next.x) * grid.extinction * min(ds, at - t);
        if added > 0.0 {
            let middle = 0.5 * (at + t);
            let rise = direction_cosine_along(grid.ground_radius, eye, altitude, grid.to_sun.y, nu, at);
            let lit = select(grid.sun, 0.0, ground_distance(grid.ground_radius, altitude, rise) >= 0.0);
            let left = exp(-depth);
            let left_kept = exp(-kept * depth);
            scatter += lit * left * peak_light(angle, 0.5 * (here.y + next.y)) * step_light(added, kept * here.y, kept * next.y);
            scatter += lit * left_kept * turned * step_light(kept * added, kept * here.y, kept * next.y);
            let up = altitude_along(grid.ground_radius, eye, dir.y, middle) - grid.bottom;
            let place = vec3<f32>(dir.x * middle / grid.size, up / grid.thickness, dir.z * middle / grid.size);
            scatter += left_kept * one_minus_exp(kept * added) * diffuse_source(place - vec3<f32>(floor(place.x), 0.0, floor(place.z)), view);
            depth += added;
        }
        here = next;
        t = at;
    }
    let through = exp(-depth);
    let behind = select(grid.uniform_light, grid.below, ground >= 0.0 || dir.y < 0.0);
    scatter += behind * (exp(-kept * depth) - through);
    results[id.x] = CubeLight(max(scatter, 0.0), through);
}
#else
@compute @workgroup_size(64)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    if i32(id.x) >= grid.count {
        return;
    }
    let ray = rays[id.x];
    let span = cube_span(ray.origin, ray.dir);
    let far = span.y;
    var t = max(span.x, 0.0);
    let nu = clamp(dot(ray.dir, grid.to_sun), -1.0, 1.0);
    let angle = acos(nu);
    let phase = phase_henyey_greenstein(nu, grid.g);
    let kept = 1.0 - grid.albedo * grid.peak;
    // Light goes against the view.
    let view = harmonics(-ray.dir);
    let straight = harmonics(-grid.to_sun);
    let d = grid.degrees;
    // Albedo and phase function without the peak, from the sun into the view.
    let turned = dot(vec4<f32>(d.x, d.y, d.y, d.y) * straight.zeroth, view.zeroth) + d.z * dot(straight.second, view.second)
        + dot(vec4<f32>(d.z, d.w, d.w, d.w) * straight.middle, view.middle) + d.w * dot(straight.third, view.third);
    let deepest = select(14.0, 14.0 / max(kept, 0.01), grid.all_orders != 0);
    var depth = 0.0;
    var scatter = 0.0;
    if t < far {
        var rho = density_at(ray.origin + ray.dir * t);
        var sun = 0.0;
        var known = false;
        for (var i = 0; i < 4000 && t < far && depth < deepest; i++) {
            let ahead = density_at(ray.origin + ray.dir * min(t + grid.step, far));
            let middle = density_at(ray.origin + ray.dir * min(t + 0.5 * grid.step, far));
            let thickest = max(max(rho, ahead), middle) * grid.extinction * grid.size;
            let ds = min(min(grid.step, max(grid.step_depth / max(thickest, 1e-20), 0.0333 * grid.step)), far - t + 1e-6);
            let point = ray.origin + ray.dir * (t + ds);
            let next = density_at(point);
            let between = density_at(ray.origin + ray.dir * (t + 0.5 * ds));
            let added = 0.16666667 * (rho + 4.0 * between + next) * grid.extinction * grid.size * ds;
            if added > 0.0 {
                if !known {
                    sun = depth_to_sun(ray.origin + ray.dir * t);
                }
                let next_sun = depth_to_sun(point);
                let left = exp(-depth);
                if grid.all_orders == 0 {
                    scatter += grid.sun * left * grid.albedo * phase * step_light(added, sun, next_sun);
                } else {
                    let left_kept = exp(-kept * depth);
                    scatter += grid.sun * left * peak_light(angle, 0.5 * (sun + next_sun)) * step_light(added, kept * sun, kept * next_sun);
                    scatter += grid.sun * left_kept * turned * step_light(kept * added, kept * sun, kept * next_sun);
                    scatter += left_kept * one_minus_exp(kept * added) * diffuse_source(point - ray.dir * (0.5 * ds), view);
                }
                sun = next_sun;
            }
            known = added > 0.0;
            depth += added;
            rho = next;
            t += ds;
        }
    }
    let through = exp(-depth);
    scatter += grid.uniform_light * (exp(-kept * depth) - through);
    // Four degrees of a needle can fall a little below nothing.
    results[id.x] = CubeLight(max(scatter, 0.0), through);
}
#endif
#endif
#endif
#endif
#endif
#endif
    }#
}#
