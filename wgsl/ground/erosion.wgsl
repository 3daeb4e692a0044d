//! What running water digs, carries and lays down, and what slides where it stands too steeply. Every function takes four cells at once.
//! source   weather digest 9 (suggestion); Mei2007 (capacity by speed)
//! symbols  load suspended sediment [m of ground] · capacity [m of ground]
#define_import_path veduta::ground::erosion

/// The load that water can carry.
///
/// domain  speed in [0, 100] m/s lin
/// domain  depth in [0, 1e4] m lin
/// domain  strength in [0, 10] s/m lin
/// domain  deepest in [0, 100] m lin
/// range   [0, 1e5] m
/// error   0.1 abs of reference::ground::capacity
/// outside undefined
/// source  weather digest 9
fn capacity(speed: vec4<f32>, depth: vec4<f32>, strength: f32, deepest: f32) -> vec4<f32> {
    return strength * speed * min(depth, vec4<f32>(deepest));
}

/// What goes from the ground into the water: dug where the load is below the capacity, laid down (negative) where it is above; all of it where no water is left.
///
/// domain  load in [0, 1e3] m lin
/// domain  most in [0, 1e3] m lin
/// domain  softness in [0, 1] 1 lin
/// domain  depth in [0, 1e4] m lin
/// domain  dig in [0, 1] 1 lin
/// domain  lay in [0, 1] 1 lin
/// range   [-1e3, 1e3] m
/// error   1e-3 abs of reference::ground::dissolved
/// outside undefined
/// source  weather digest 9
fn dissolved(load: vec4<f32>, most: vec4<f32>, softness: vec4<f32>, depth: vec4<f32>, dig: f32, lay: f32) -> vec4<f32> {
    let gap = most - load;
    let moved = select(gap * lay, gap * dig * softness, gap > vec4<f32>(0.0));
    return select(max(moved, -load), -load, depth < vec4<f32>(1e-5));
}

/// What slides to this cell from a neighbour that stands higher than a slope allows; from this cell (negative) when it stands so.
///
/// domain  ground in [-1e4, 1e4] m lin
/// domain  beside in [-1e4, 1e4] m lin
/// domain  steepest in [0, 1e3] m lin
/// domain  rate in [0, 0.2] 1 lin
/// range   [-4e3, 4e3] m
/// error   2e-3 abs of reference::ground::slid
/// outside undefined
/// source  ours: the same number with opposite signs on both sides of an edge
fn slid(ground: vec4<f32>, beside: vec4<f32>, steepest: f32, rate: f32) -> vec4<f32> {
    let above = beside - ground;
    return rate * (max(above - steepest, vec4<f32>(0.0)) - max(-above - steepest, vec4<f32>(0.0)));
}
