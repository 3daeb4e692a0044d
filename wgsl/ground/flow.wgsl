//! Water that runs by differences of level: four outflow speeds a cell, damped, never more than there is. Every function takes four cells at once.
//! source   weather digest 4.2, 4.3 (pipes between columns); resting levels: ours
//! symbols  level ground plus water [m] · speed outflow speed to one side [m/step unit] · step of time [1]
#define_import_path veduta::ground::flow

/// The difference of two levels, and nothing when it is not more than the last places of the higher one and of the water: so water comes to rest.
///
/// domain  level in [-1e4, 1e4] m lin
/// domain  beside in [-1e4, 1e4] m lin
/// domain  water in [0, 1e4] m lin
/// range   [-2e4, 2e4] m
/// error   5e-3 abs of reference::ground::level_drop
/// source  ours
fn level_drop(level: vec4<f32>, beside: vec4<f32>, water: vec4<f32>) -> vec4<f32> {
    let drop = level - beside;
    return select(drop, vec4<f32>(0.0), abs(drop) <= 1.2e-7 * (max(abs(level), abs(beside)) + water));
}

/// An outflow speed after a step: driven by the drop to that side, damped, never backwards.
///
/// domain  speed in [0, 1e3] m lin
/// domain  drop in [-1e4, 1e4] m lin
/// domain  step in [0, 1] 1 lin
/// domain  damping in [0, 1] 1 lin
/// range   [0, 1.2e4] m
/// error   2e-3 abs of reference::ground::driven_speed
/// outside undefined
/// source  weather digest 4.2; departs: below 1e-8 it is nothing
fn driven_speed(speed: vec4<f32>, drop: vec4<f32>, step: f32, damping: f32) -> vec4<f32> {
    let faster = (speed + drop * step) * damping;
    return select(vec4<f32>(0.0), faster, faster > vec4<f32>(1e-8));
}

/// Factor on a cell's outflow speeds, so that no more leaves than there is.
///
/// domain  water in [1e-6, 1e4] m log
/// domain  outflow in [1e-6, 1e5] m log
/// range   [0, 1] 1
/// error   1e-6 abs of reference::ground::outflow_share
/// outside undefined
/// source  weather digest 4.2; departs: a millionth stays, for the rounding of sums
fn outflow_share(water: vec4<f32>, outflow: vec4<f32>) -> vec4<f32> {
    let most = water * 0.999999;
    return select(vec4<f32>(1.0), most / max(outflow, vec4<f32>(1e-30)), outflow > most);
}

/// The speed of water that stays, mixed with that of what arrives in the same direction.
///
/// domain  speed in [0, 1e3] m lin
/// domain  kept in [1e-6, 1e4] m log
/// domain  arriving_speed in [0, 1e3] m lin
/// domain  arriving in [0, 1e4] m lin
/// range   [0, 1.001e3] m
/// error   2e-3 abs of reference::ground::mixed_speed
/// outside undefined
/// source  weather digest 4.3 (suggestion)
fn mixed_speed(speed: vec4<f32>, kept: vec4<f32>, arriving_speed: vec4<f32>, arriving: vec4<f32>) -> vec4<f32> {
    // One product in one sum: compilers that fuse them do it alike for all directions.
    let share = arriving / max(kept + arriving, vec4<f32>(1e-20));
    return speed + (arriving_speed - speed) * share;
}
