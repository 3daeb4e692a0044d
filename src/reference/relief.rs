//! Height maps from their definition: a kernel over the texels of every level.

/// A height map with the means over larger and larger squares.
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    /// What lies beyond the border: 0 the map again, 1 mirrored, 2 the border's heights.
    pub edge: i32,
    /// Width of a texel.
    pub texel: f64,
    /// Of each level the texels along both axes; heights and mean squares of the slopes.
    pub levels: Vec<([usize; 2], Vec<[f64; 2]>)>,
}

/// Keys's kernel with a = -1/2 and its slope.
fn kernel(x: f64) -> [f64; 2] {
    let (a, sign) = (x.abs(), x.signum());
    if a < 1.0 {
        [
            1.5 * a.powi(3) - 2.5 * a * a + 1.0,
            sign * (4.5 * a * a - 5.0 * a),
        ]
    } else if a < 2.0 {
        [
            -0.5 * a.powi(3) + 2.5 * a * a - 4.0 * a + 2.0,
            sign * (-1.5 * a * a + 5.0 * a - 4.0),
        ]
    } else {
        [0.0; 2]
    }
}

impl Relief {
    fn texel(&self, level: usize, [x, z]: [i64; 2]) -> [f64; 2] {
        let (size, texels) = &self.levels[level];
        let within = |i: i64, n: usize| -> usize {
            let n = n as i64;
            let at = match self.edge {
                0 => i.rem_euclid(n),
                1 => [i, -1 - i]
                    .map(|k| k.rem_euclid(2 * n))
                    .into_iter()
                    .fold(2 * n, i64::min),
                _ => i.clamp(0, n - 1),
            };
            at as usize
        };
        texels[within(z, size[1]) * size[0] + within(x, size[0])]
    }

    /// The pyramid of a map given row by row.
    pub fn new(size: [usize; 2], heights: &[f64], edge: i32, texel: f64) -> Relief {
        let all = heights.iter().map(|h| [*h, 0.0]).collect();
        let mut relief = Relief {
            edge,
            texel,
            levels: vec![(size, all)],
        };
        let mut squares = Vec::new();
        for z in 0..size[1] as i64 {
            for x in 0..size[0] as i64 {
                let rise = |dx: i64, dz: i64| {
                    relief.texel(0, [x + dx, z + dz])[0] - relief.texel(0, [x - dx, z - dz])[0]
                };
                squares.push((rise(1, 0).powi(2) + rise(0, 1).powi(2)) / (2.0 * texel).powi(2));
            }
        }
        for (texel, square) in relief.levels[0].1.iter_mut().zip(squares) {
            texel[1] = square;
        }
        while relief.levels[relief.levels.len() - 1].0 != [1, 1] {
            let (from, texels) = &relief.levels[relief.levels.len() - 1];
            let to = from.map(|n| (n / 2).max(1));
            // The share of texel k that lies within texel i of the next level.
            let part = |i: usize, k: usize, axis: usize| -> f64 {
                let wide = from[axis] as f64 / to[axis] as f64;
                let begin = (i as f64 * wide).max(k as f64);
                let end = ((i + 1) as f64 * wide).min((k + 1) as f64);
                (end - begin).max(0.0) / wide
            };
            let mut next = vec![[0.0; 2]; to[0] * to[1]];
            for (at, mean) in next.iter_mut().enumerate() {
                let [x, z] = [at % to[0], at / to[0]];
                for k in 2 * z..(2 * z + 4).min(from[1]) {
                    for i in 2 * x..(2 * x + 4).min(from[0]) {
                        let share = part(x, i, 0) * part(z, k, 1);
                        for c in 0..2 {
                            mean[c] += share * texels[k * from[0] + i][c];
                        }
                    }
                }
            }
            relief.levels.push((to, next));
        }
        relief
    }

    /// Height, slopes, and mean square of the slopes on a level, at a place in texels of the map from the middle of its first.
    fn level(&self, level: usize, place: [f64; 2]) -> [f64; 4] {
        let (whole, size) = (self.levels[0].0, self.levels[level].0);
        let ratio = [0, 1].map(|k| size[k] as f64 / whole[k] as f64);
        let u = [0, 1].map(|k| (place[k] + 0.5) * ratio[k] - 0.5);
        let below = u.map(|c| c.floor());
        let mut all = [0.0; 4];
        for j in -1..=2_i64 {
            for i in -1..=2_i64 {
                let at = [below[0] as i64 + i, below[1] as i64 + j];
                let away = [u[0] - at[0] as f64, u[1] - at[1] as f64];
                let [x, z] = away.map(kernel);
                let [height, square] = self.texel(level, at);
                all[0] += height * x[0] * z[0];
                all[1] += height * x[1] * z[0] * ratio[0] / self.texel;
                all[2] += height * x[0] * z[1] * ratio[1] / self.texel;
                let [near, there] = away.map(|a| (1.0 - a.abs()).max(0.0));
                all[3] += square * near * there;
            }
        }
        all
    }
}

/// Height, slope and mean square of the slopes left out at a place in texels from the middle of the first, filtered by a footprint (m).
pub fn ground(relief: &Relief, place: [f64; 2], footprint: f64) -> super::field::Ground {
    let ratio = (std::f64::consts::FRAC_1_SQRT_2 * footprint / relief.texel).max(1.0);
    let last = relief.levels.len() - 1;
    let level = (ratio.log2().floor() as usize).min(last);
    let x = (2.0 * (level as f64).exp2() / ratio - 1.0).clamp(0.0, 1.0);
    let keep = if level == last {
        1.0
    } else {
        x * x * (3.0 - 2.0 * x)
    };
    let [fine, coarse] = [level, (level + 1).min(last)].map(|l| relief.level(l, place));
    let mixed: [f64; 4] = std::array::from_fn(|k| keep * fine[k] + (1.0 - keep) * coarse[k]);
    let left = mixed[3] - mixed[1].powi(2) - mixed[2].powi(2);
    super::field::Ground {
        height: mixed[0],
        slope: [mixed[1], mixed[2]],
        lost: left.max(0.0) * if level == 0 { 1.0 - keep } else { 1.0 },
    }
}
