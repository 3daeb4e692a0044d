//! The living ground in f64: the functions of its modules one cell at a time, and one step of either scheme, written from the formulas.

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

/// Coefficients of erosion: capacity, deepest, dig, lay, height difference from which ground slides, share that slides.
pub type Digging = [f64; 6];

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

    /// One step of the source's scheme; what ran off over the edges (m).
    pub fn source_step(
        &mut self,
        edge: Edge,
        step: f64,
        damping: f64,
        momentum: bool,
        digging: Option<Digging>,
    ) -> f64 {
        let count = self.columns * self.rows;
        let level: Vec<f64> = self
            .ground
            .iter()
            .zip(&self.water)
            .map(|(g, w)| g + w)
            .collect();
        let mut run_off = 0.0;
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
        if let Some([strength, deepest, dig, lay, steepest, rate]) = digging {
            let before = self.ground.clone();
            for k in 0..count {
                let v = speeds[k];
                let speed = (v[0] - v[2]).hypot(v[1] - v[3]);
                let most = capacity(speed, self.water[k], strength, deepest);
                let dug = dissolved(self.load[k], most, 1.0, self.water[k], dig, lay);
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
                    run_off += speeds[k][side] * step;
                }
            }
            self.water[k] = water[k] + arriving - out;
            self.load[k] = load[k] + brought - concentration[k] * out;
        }
        run_off
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
    /// One step: gravity, friction, spacing (m), step (s). What ran off (m).
    pub fn step(
        &mut self,
        edge: Edge,
        gravity: f64,
        friction: f64,
        spacing: f64,
        step: f64,
    ) -> f64 {
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
                let mut next = u + gain * share / all.max(1.0);
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
        let mut run_off = 0.0;
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
                run_off += fall * ends * scale;
            }
            self.water[k] = old.water[k] + more * scale;
        }
        run_off
    }
}
