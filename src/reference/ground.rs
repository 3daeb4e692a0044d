//! The living ground in f64: the functions of its modules one cell at a time, and one step of either scheme, written from the formulas.

use super::noise::value_noise_2d;

/// Difference of two levels, nothing within the last places of the higher one and of the water.
pub fn level_drop(level: f64, beside: f64, water: f64) -> f64 {
    let drop = level - beside;
    if drop.abs() <= 1.2e-7 * (level.abs().max(beside.abs()) + water) {
        0.0
    } else {
        drop
    }
}

/// An outflow speed after a step.
pub fn driven_speed(speed: f64, drop: f64, step: f64, damping: f64) -> f64 {
    let faster = (speed + drop * step) * damping;
    if faster > 1e-8 { faster } else { 0.0 }
}

/// Factor on a cell's outflow speeds.
pub fn outflow_share(water: f64, outflow: f64) -> f64 {
    let most = water * 0.999999;
    if outflow > most {
        most / outflow.max(1e-30)
    } else {
        1.0
    }
}

/// The speed of what stays and what arrives.
pub fn mixed_speed(speed: f64, kept: f64, arriving_speed: f64, arriving: f64) -> f64 {
    (speed * kept + arriving_speed * arriving) / (kept + arriving).max(1e-20)
}

/// Depth over the higher ground of a face.
pub fn sill_depth(depth: f64, rise: f64) -> f64 {
    (depth - rise.max(0.0)).max(0.0)
}

/// Discharge through a face.
pub fn discharge(speed: f64, near: f64, far: f64) -> f64 {
    speed.max(0.0) * near + speed.min(0.0) * far
}

/// A speed after bed friction.
pub fn rubbed_speed(speed: f64, depth: f64, friction: f64, gravity: f64, step: f64) -> f64 {
    let deep = depth.max(1e-4);
    let rate = gravity * friction * friction * speed.abs() / deep.powf(4.0 / 3.0);
    speed / (1.0 + step * rate)
}

/// The load that water can carry.
pub fn capacity(speed: f64, depth: f64, strength: f64, deepest: f64) -> f64 {
    strength * speed * depth.min(deepest)
}

/// What goes from the ground into the water.
pub fn dissolved(load: f64, most: f64, softness: f64, depth: f64, dig: f64, lay: f64) -> f64 {
    if depth < f64::from(1e-5_f32) {
        return -load;
    }
    let gap = most - load;
    let moved = if gap > 0.0 {
        gap * dig * softness
    } else {
        gap * lay
    };
    moved.max(-load)
}

/// What slides to a cell from a neighbour.
pub fn slid(ground: f64, beside: f64, steepest: f64, rate: f64) -> f64 {
    let above = beside - ground;
    rate * ((above - steepest).max(0.0) - (-above - steepest).max(0.0))
}

/// A smooth bump of height 1 that ends at 1.
pub fn bump(r: f64) -> f64 {
    let t = (1.0 - r.abs()).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Share of the relief of a plain with a river bed.
pub fn bed_share(x: f64, z: f64) -> f64 {
    let middle = 0.2 * (4.0 * std::f64::consts::PI * x).sin();
    -0.5 * x - 0.5 * bump((2.0 * z - 1.0 - middle) / 0.1)
}

/// A height smoothed by its neighbours at the sides and at the corners.
pub fn smoothed_height(height: f64, sides: [f64; 4], corners: [f64; 4]) -> f64 {
    let sum = |all: [f64; 4]| all.iter().sum::<f64>();
    (4.0 * height + 2.0 * sum(sides) + sum(corners)) / 16.0
}

/// A pass of smoothing over heights by rows; beyond the edges the edge, or with `wraps` the other edge.
pub fn smoothed(heights: &[f64], columns: usize, rows: usize, wraps: bool) -> Vec<f64> {
    let beside = |n: usize, by: i64, size: usize| {
        let at = n as i64 + by;
        if wraps {
            at.rem_euclid(size as i64) as usize
        } else {
            at.clamp(0, size as i64 - 1) as usize
        }
    };
    (0..rows * columns)
        .map(|k| {
            let at = |dx: i64, dz: i64| {
                heights[beside(k / columns, dz, rows) * columns + beside(k % columns, dx, columns)]
            };
            let sides = [at(-1, 0), at(1, 0), at(0, -1), at(0, 1)];
            let corners = [at(-1, -1), at(1, 1), at(-1, 1), at(1, -1)];
            smoothed_height(at(0, 0), sides, corners)
        })
        .collect()
}

/// Share by which ground is dug at a column and row and a height (m): less where spots or layers are hard.
pub fn softness(x: f64, z: f64, height: f64, hardness: f64, wavelength: f64, layer: f64) -> f64 {
    let hard = if layer > 0.0 {
        0.5 + 0.5 * (std::f64::consts::TAU * (height / layer)).cos()
    } else if wavelength > 0.0 {
        let at = [x, z].map(|v| v / wavelength.max(1.0));
        let cell = at.map(f64::floor);
        let frac = [at[0] - cell[0], at[1] - cell[1]];
        0.5 + 0.5 * value_noise_2d(cell.map(|c| c as i32), frac, 7)
    } else {
        0.0
    };
    1.0 - hardness * hard
}

/// What comes from the sky and the depth, in metres a second.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Weather {
    /// Rain everywhere.
    pub rain: f64,
    /// Evaporation, of no more than there is.
    pub evaporation: f64,
    /// Seepage, of no more than is left.
    pub seepage: f64,
    /// Springs: column, row, radius (cells) and depth that wells up in their cells.
    pub springs: Vec<[f64; 4]>,
}

impl Weather {
    /// Depth that falls and wells up in a cell in a second.
    pub fn fresh(&self, x: i64, z: i64) -> f64 {
        self.rain + self.sprung(x, z)
    }

    fn sprung(&self, x: i64, z: i64) -> f64 {
        self.springs
            .iter()
            .filter(|s| (x as f64 - s[0]).powi(2) + (z as f64 - s[1]).powi(2) <= s[2] * s[2])
            .map(|s| s[3])
            .sum()
    }

    /// Does to a cell's water what a step's weather does, and notes it.
    fn falls(&self, water: &mut f64, x: i64, z: i64, step: f64, went: &mut Went) {
        let gained = self.fresh(x, z) * step;
        let there = water.max(0.0);
        let evaporated = there.min(self.evaporation * step);
        let seeped = (there - evaporated).min(self.seepage * step);
        *water += gained - evaporated - seeped;
        went.gained += gained;
        went.evaporated += evaporated;
        went.seeped += seeped;
    }
}

/// What came and went in a step, summed over cells (m).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Went {
    /// Rained and sprung up.
    pub gained: f64,
    /// Evaporated.
    pub evaporated: f64,
    /// Seeped away.
    pub seeped: f64,
    /// Run off over open edges.
    pub run_off: f64,
    /// Load run off with it.
    pub load_off: f64,
}

/// Level at which the water of a cell is shown, from levels and depths of its eight neighbours, those at the sides first.
#[allow(clippy::too_many_arguments)]
pub fn displayed_level(
    level: f64,
    water: f64,
    side_levels: [f64; 4],
    corner_levels: [f64; 4],
    side_waters: [f64; 4],
    corner_waters: [f64; 4],
    least: f64,
    sink: f64,
) -> f64 {
    if water >= least {
        return level;
    }
    let neighbours = || {
        side_levels
            .into_iter()
            .zip(side_waters)
            .chain(corner_levels.into_iter().zip(corner_waters))
    };
    let share = water / least;
    let lower = || neighbours().filter(|(z, _)| *z < level);
    let weight: f64 = lower().map(|(_, w)| w).sum();
    if weight > f64::from(1e-12_f32) {
        let mean = lower().map(|(z, w)| z * w).sum::<f64>() / weight;
        return level * share + mean * (1.0 - share);
    }
    let wettest = neighbours().fold(water, |most, (_, w)| most.max(w));
    let t = (wettest / (0.1 * least)).clamp(0.0, 1.0);
    let dry = if lower().next().is_some() {
        1.0
    } else {
        1.0 - t * t * (3.0 - 2.0 * t)
    };
    level - dry * sink * (1.0 - share)
}

/// Unit normal by central differences, from the neighbours to -x, +x, -z and +z.
pub fn fast_normal(left: f64, right: f64, low: f64, high: f64, spacing: f64) -> [f64; 3] {
    let [x, y, z] = [left - right, 2.0 * spacing, low - high];
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

/// The level that a neighbour counts with in the normal of the water.
pub fn counted_level(centre: f64, beside: f64, ground_beside: f64) -> f64 {
    if beside < ground_beside {
        centre
    } else {
        beside
    }
}

/// What lies beyond the edges: open, closed or periodic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// The same ground without water.
    Open,
    /// A wall.
    Closed,
    /// The opposite edge.
    Periodic,
}

/// A grid of cells: ground, water, load and four outflow speeds (to +x, +z, -x, -z) of the source's scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// Cells along x.
    pub columns: usize,
    /// Cells along z.
    pub rows: usize,
    /// Height of the ground (m), by rows.
    pub ground: Vec<f64>,
    /// Depth of the water (m).
    pub water: Vec<f64>,
    /// Suspended load (m).
    pub load: Vec<f64>,
    /// Outflow speeds to +x, +z, -x, -z.
    pub speeds: Vec<[f64; 4]>,
}

/// Coefficients of erosion: capacity, deepest, dig, lay, height difference from which ground slides, share that slides, hardness, wavelength of hard spots (cells), thickness of layers (m).
pub type Digging = [f64; 9];

const SIDES: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

impl Cells {
    fn beside(&self, cell: usize, side: usize, edge: Edge) -> Option<usize> {
        let (x, z) = ((cell % self.columns) as i64, (cell / self.columns) as i64);
        let (nx, nz) = (x + SIDES[side].0, z + SIDES[side].1);
        let (columns, rows) = (self.columns as i64, self.rows as i64);
        let there = (0..columns).contains(&nx) && (0..rows).contains(&nz);
        if there || edge == Edge::Periodic {
            let (nx, nz) = (nx.rem_euclid(columns), nz.rem_euclid(rows));
            Some((nz * columns + nx) as usize)
        } else {
            None
        }
    }

    /// One step of the source's scheme.
    pub fn source_step(
        &mut self,
        edge: Edge,
        step: f64,
        damping: f64,
        momentum: bool,
        digging: Option<Digging>,
        weather: &Weather,
    ) -> Went {
        let count = self.columns * self.rows;
        let level: Vec<f64> = self
            .ground
            .iter()
            .zip(&self.water)
            .map(|(g, w)| g + w)
            .collect();
        let mut went = Went::default();
        let mut speeds = self.speeds.clone();
        for (k, v) in speeds.iter_mut().enumerate() {
            for (side, v) in v.iter_mut().enumerate() {
                let beyond = match (self.beside(k, side, edge), edge) {
                    (Some(n), _) => level[n],
                    (None, Edge::Open) => self.ground[k],
                    (None, _) => {
                        *v = 0.0;
                        continue;
                    }
                };
                *v = driven_speed(
                    *v,
                    level_drop(level[k], beyond, self.water[k]),
                    step,
                    damping,
                );
            }
            let share = outflow_share(self.water[k], v.iter().sum::<f64>() * step);
            v.iter_mut().for_each(|v| *v *= share);
        }
        let mut concentration = vec![0.0; count];
        if let Some(
            [
                strength,
                deepest,
                dig,
                lay,
                steepest,
                rate,
                hardness,
                wavelength,
                layer,
            ],
        ) = digging
        {
            let before = self.ground.clone();
            for k in 0..count {
                let v = speeds[k];
                let speed = (v[0] - v[2]).hypot(v[1] - v[3]);
                let most = capacity(speed, self.water[k], strength, deepest);
                let (x, z) = ((k % self.columns) as f64, (k / self.columns) as f64);
                let soft = softness(x, z, before[k], hardness, wavelength, layer);
                let dug = dissolved(self.load[k], most, soft, self.water[k], dig, lay);
                self.load[k] += dug;
                concentration[k] = self.load[k].max(0.0) / self.water[k].max(1e-12) * 0.999999;
                self.ground[k] -= dug;
                for side in 0..4 {
                    if let Some(n) = self.beside(k, side, edge) {
                        self.ground[k] += slid(before[k], before[n], steepest, rate);
                    }
                }
            }
        }
        let (water, load) = (self.water.clone(), self.load.clone());
        for k in 0..count {
            let out = speeds[k].iter().sum::<f64>() * step;
            let kept = if out >= water[k] * 0.999998 {
                water[k] * 1e-6
            } else {
                water[k] - out
            };
            let (mut arriving, mut brought) = (0.0, 0.0);
            for (side, _) in SIDES.iter().enumerate() {
                // What travels to `side` comes from the neighbour opposite.
                let opposite = (side + 2) % 4;
                let from = self.beside(k, opposite, edge);
                let speed = from.map_or(0.0, |n| speeds[n][side]);
                arriving += speed * step;
                brought += from.map_or(0.0, |n| concentration[n]) * speed * step;
                self.speeds[k][side] = if momentum {
                    mixed_speed(speeds[k][side], kept, speed, speed * step)
                } else {
                    speeds[k][side]
                };
                if self.beside(k, side, edge).is_none() {
                    went.run_off += speeds[k][side] * step;
                    went.load_off += concentration[k] * speeds[k][side] * step;
                }
            }
            self.water[k] = water[k] + arriving - out;
            self.load[k] = load[k] + brought - concentration[k] * out;
            let (x, z) = ((k % self.columns) as i64, (k / self.columns) as i64);
            weather.falls(&mut self.water[k], x, z, step, &mut went);
        }
        went
    }
}

/// Shallow water on a staggered grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Shallow {
    /// Cells along x.
    pub columns: usize,
    /// Cells along z.
    pub rows: usize,
    /// Height of the ground (m), by rows.
    pub ground: Vec<f64>,
    /// Depth (m).
    pub water: Vec<f64>,
    /// Speed through the faces to +x and to +z (m/s).
    pub speeds: Vec<[f64; 2]>,
    /// Discharge through them (m^2/s).
    pub discharges: Vec<[f64; 2]>,
}

impl Shallow {
    /// One step: gravity, friction, spacing (m), step (s).
    pub fn step(
        &mut self,
        edge: Edge,
        gravity: f64,
        friction: f64,
        spacing: f64,
        step: f64,
        weather: &Weather,
    ) -> Went {
        let (columns, rows) = (self.columns as i64, self.rows as i64);
        let index = |x: i64, z: i64| -> Option<usize> {
            let there = (0..columns).contains(&x) && (0..rows).contains(&z);
            (there || edge == Edge::Periodic)
                .then(|| (z.rem_euclid(rows) * columns + x.rem_euclid(columns)) as usize)
        };
        let scale = step / spacing;
        let old = self.clone();
        let places: Vec<(i64, i64)> = (0..rows)
            .flat_map(|z| (0..columns).map(move |x| (x, z)))
            .collect();
        for (k, &(x, z)) in places.iter().enumerate() {
            for axis in 0..2 {
                // Along the axis, and across it.
                let (a, c) = if axis == 0 {
                    ((1, 0), (0, 1))
                } else {
                    ((0, 1), (1, 0))
                };
                let Some(far) = index(x + a.0, z + a.1) else {
                    self.speeds[k][axis] = 0.0;
                    continue;
                };
                let u = old.speeds[k][axis];
                let speed = |n: Option<usize>, other: f64| n.map_or(other, |n| old.speeds[n][axis]);
                let q = |n: Option<usize>, axis: usize| n.map_or(0.0, |n| old.discharges[n][axis]);
                let back = index(x - a.0, z - a.1);
                let (low, high) = (index(x - c.0, z - c.1), index(x + c.0, z + c.1));
                let far_low = index(x + a.0 - c.0, z + a.1 - c.1);
                let own = Some(k);
                let q_back = 0.5 * (q(back, axis) + q(own, axis));
                let q_far = 0.5 * (q(own, axis) + q(Some(far), axis));
                let (before, behind) = (speed(back, 0.0), speed(Some(far), 0.0));
                let (near_h, far_h) = (old.water[k], old.water[far]);
                let rise = old.ground[far] - old.ground[k];
                let (over_near, over_far) = (sill_depth(near_h, rise), sill_depth(far_h, -rise));
                // Of what runs across, that over the higher ground.
                let (near_share, far_share) =
                    (over_near / near_h.max(1e-9), over_far / far_h.max(1e-9));
                let across = |near, far| {
                    0.5 * (q(near, 1 - axis) * near_share + q(far, 1 - axis) * far_share)
                };
                let (q_low, q_high) = (across(low, far_low), across(own, Some(far)));
                let depth = (0.5 * (over_near + over_far)).max(1e-7);
                // Head where the flow gains speed along itself, else momentum.
                let mut with_before = q_back.max(0.0);
                if u > before {
                    with_before = with_before.min((0.5 * (before + u)).max(0.0) * depth);
                }
                let mut with_behind = (-q_far).max(0.0);
                if u < behind {
                    with_behind = with_behind.min((-0.5 * (behind + u)).max(0.0) * depth);
                }
                let arriving = [
                    (with_before, before),
                    (with_behind, behind),
                    (q_low.max(0.0), speed(low, u)),
                    ((-q_high).max(0.0), speed(high, u)),
                ];
                let share = scale / depth;
                let all = arriving.iter().map(|(q, _)| q).sum::<f64>() * share;
                let gain: f64 = arriving.iter().map(|(q, v)| q * (v - u)).sum();
                // What falls and wells up on both sides joins at rest.
                let (far_x, far_z) = (far as i64 % columns, far as i64 / columns);
                let fresh = 0.5 * (weather.fresh(x, z) + weather.fresh(far_x, far_z));
                let mut next = (u + gain * share / all.max(1.0)) * (depth / (depth + fresh * step));
                let drop = level_drop(
                    old.ground[k] + near_h,
                    old.ground[far] + far_h,
                    near_h.max(far_h),
                );
                next += gravity * scale * drop;
                next = rubbed_speed(next, over_near.max(over_far), friction, gravity, step);
                let most = 0.249 / scale;
                next = next.clamp(-most, most);
                if (next > 0.0 && over_near <= 1e-7) || (next < 0.0 && over_far <= 1e-7) {
                    next = 0.0;
                }
                self.speeds[k][axis] = if next.abs() < 1e-8 { 0.0 } else { next };
            }
        }
        for (k, &(x, z)) in places.iter().enumerate() {
            for axis in 0..2 {
                let a = if axis == 0 { (1, 0) } else { (0, 1) };
                self.discharges[k][axis] = index(x + a.0, z + a.1).map_or(0.0, |far| {
                    let rise = old.ground[far] - old.ground[k];
                    let near = sill_depth(old.water[k], rise);
                    discharge(
                        self.speeds[k][axis],
                        near,
                        sill_depth(old.water[far], -rise),
                    )
                });
            }
        }
        let mut went = Went::default();
        for (k, &(x, z)) in places.iter().enumerate() {
            let q = |n: Option<usize>, axis: usize| n.map_or(0.0, |n| self.discharges[n][axis]);
            let mut more = q(index(x - 1, z), 0) - self.discharges[k][0]
                + (q(index(x, z - 1), 1) - self.discharges[k][1]);
            if edge == Edge::Open {
                let h = old.water[k];
                let fall = h * (gravity * h).max(0.0).sqrt().min(0.249 / scale);
                let ends = [(1, 0), (0, 1), (-1, 0), (0, -1)]
                    .iter()
                    .filter(|(dx, dz)| index(x + dx, z + dz).is_none())
                    .count() as f64;
                more -= fall * ends;
                went.run_off += fall * ends * scale;
            }
            self.water[k] = old.water[k] + more * scale;
            weather.falls(&mut self.water[k], x, z, step, &mut went);
        }
        went
    }
}
