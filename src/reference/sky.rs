//! Sky radiance scattered once, by quadrature with an error estimate, in any air and with the planet's shadow.
//!
//! Lengths in metres, coefficients in 1/m. The eye stands on the y axis at an altitude >= 0, at most about 1e8; directions
//! are unit vectors with y up at the eye. Radiance is relative to the sun's irradiance outside the air.

use super::math::{add, dot, scale};
use super::monte_carlo::lambert;
use super::quadrature::{Rule, Tolerance, integrate_kronrod};
use crate::atmosphere::{Atmosphere, Lane, Lobe, MOST_LANES, Profile};
use crate::error::Error;
use std::sync::OnceLock;

/// A number for each profile of a [`Sky`], in the order in which the layers name them first; what is beyond is 0.
pub type Amounts = [f64; MOST_LANES];

/// The air and the ground below, with what the integrals need at hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    atmosphere: Atmosphere,
    /// The different profiles of all layers.
    pub(super) profiles: Vec<Profile>,
    /// The exponential ones: which, and the reciprocal of the scale height.
    exponentials: Vec<(usize, f64)>,
    /// Extinction of each profile's layers together, at density 1.
    pub(super) extinctions: Vec<[f64; 3]>,
    /// What scatters.
    pub(super) scatterers: Vec<Scatterer>,
    /// Radii at which densities bend, above the ground.
    bends: Vec<f64>,
}

/// A lobe of a layer that scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scatterer {
    /// Which profile.
    pub profile: usize,
    /// Scattering at density 1.
    pub scattering: [f64; 3],
    /// Where it goes.
    pub lobe: Lobe,
}

impl Default for Sky {
    /// That of the default atmosphere.
    fn default() -> Self {
        Sky::of_valid(&Atmosphere::default())
    }
}

/// A view ray from the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyRay {
    /// Altitude of the eye.
    pub eye_altitude: f64,
    /// Unit vector of the view.
    pub dir: [f64; 3],
    /// Unit vector to the sun.
    pub to_sun: [f64; 3],
    /// Where the ray ends, if not at the ground or the top before; may be infinite.
    pub distance: f64,
}

/// Light of one scattering along a view ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyRadiance {
    /// Radiance scattered into the ray [1/sr].
    pub in_scatter: [f64; 3],
    /// Estimated absolute error of that.
    pub error: [f64; 3],
    /// Radiance of the ground under the sun alone, as it reaches the eye; 0 where the ray does not end on the ground.
    pub reflected: [f64; 3],
    /// Transmittance of the ray.
    pub transmittance: [f64; 3],
    /// Points of the ray that were lit and summed.
    pub evaluations: usize,
}

/// A stretch of a straight line as seen from the planet's centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    /// Distance of the line from the centre.
    pub closest: f64,
    /// Start, along the line from the point closest to the centre.
    pub from: f64,
    /// End, likewise.
    pub to: f64,
}

/// The part of a view ray within the air.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// The line of the ray, from its entry into the air to its end there.
    pub chord: Chord,
    /// Distance from the eye to the entry.
    pub near: f64,
    /// Distance from the eye to the end.
    pub end: f64,
    /// Whether the end is the ground.
    pub ground: bool,
    /// Whether the end is the top of the air.
    pub space: bool,
}

fn inner_rule() -> &'static Rule {
    static RULE: OnceLock<Rule> = OnceLock::new();
    RULE.get_or_init(|| Rule::new(16))
}

/// Half the length of the chord that a sphere cuts from a line at the distance `closest` from its centre.
fn half_chord(radius: f64, closest: f64) -> Option<f64> {
    let square = (radius - closest) * (radius + closest);
    (square > 0.0).then(|| square.sqrt())
}

/// Real roots of a t^2 + 2 b t + c in no order; none where they coincide.
fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - a * c;
    if discriminant <= 0.0 {
        return [None, None];
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let finite = |t: f64| t.is_finite().then_some(t);
    [finite(q / a), finite(c / q)]
}

impl Sky {
    /// The sky of an atmosphere; its sun is not used, because radiance is relative to it.
    ///
    /// # Errors
    /// As [`Atmosphere::check`].
    pub fn new(atmosphere: &Atmosphere) -> Result<Sky, Error> {
        atmosphere.check()?;
        Ok(Sky::of_valid(atmosphere))
    }

    fn of_valid(atmosphere: &Atmosphere) -> Sky {
        let mut sky = Sky {
            atmosphere: atmosphere.clone(),
            profiles: Vec::new(),
            exponentials: Vec::new(),
            extinctions: Vec::new(),
            scatterers: Vec::new(),
            bends: Vec::new(),
        };
        for Lane {
            profile,
            extinction,
            scattering,
            lobe,
        } in atmosphere.lanes()
        {
            let known = sky.profiles.iter().position(|p| *p == profile);
            let k = known.unwrap_or_else(|| {
                sky.profiles.push(profile);
                sky.extinctions.push([0.0; 3]);
                sky.profiles.len() - 1
            });
            for (sum, more) in sky.extinctions[k].iter_mut().zip(extinction) {
                *sum += more;
            }
            if let Some(lobe) = lobe {
                sky.scatterers.push(Scatterer {
                    profile: k,
                    scattering,
                    lobe,
                });
            }
        }
        for (k, profile) in sky.profiles.iter().enumerate() {
            if let Profile::Exponential { scale_height } = profile {
                sky.exponentials.push((k, scale_height.recip()));
            }
            let inside = profile.bends().into_iter();
            sky.bends.extend(
                inside
                    .filter(|h| *h > 0.0 && *h < atmosphere.thickness)
                    .map(|h| atmosphere.planet_radius + h),
            );
        }
        sky.bends.sort_by(f64::total_cmp);
        sky.bends.dedup();
        sky
    }

    /// What the air is.
    pub fn atmosphere(&self) -> &Atmosphere {
        &self.atmosphere
    }

    /// Radius of the ground.
    pub(super) fn ground(&self) -> f64 {
        self.atmosphere.planet_radius
    }

    /// Radius of the top of the air.
    pub(super) fn top_radius(&self) -> f64 {
        self.atmosphere.planet_radius + self.atmosphere.thickness
    }

    /// Densities relative to their greatest, at an altitude; below the ground those at it.
    pub fn densities(&self, h: f64) -> Amounts {
        let mut densities = [0.0; MOST_LANES];
        for (density, profile) in densities.iter_mut().zip(&self.profiles) {
            *density = profile.density(h);
        }
        densities
    }

    /// Extinction of densities, or optical depth of columns.
    pub fn extinction(&self, amounts: Amounts) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (amount, extinction) in amounts.iter().zip(&self.extinctions) {
            for (sum, extinction) in sum.iter_mut().zip(extinction) {
                *sum += extinction * amount;
            }
        }
        sum
    }

    /// Density integrals (m) over `distance` of a ray that starts at the altitude `h` with the zenith cosine `mu` and stays
    /// above the ground. Within 1e-11 relative for exponential layers, 1e-5 m for others.
    pub fn columns(&self, h: f64, mu: f64, distance: f64) -> Amounts {
        let r = self.ground() + h;
        self.chord_columns(Chord {
            closest: r * ((1.0 - mu) * (1.0 + mu)).max(0.0).sqrt(),
            from: r * mu,
            to: r * mu + distance,
        })
    }

    /// Density integrals of a chord: outwards from its lowest point on both sides.
    pub(super) fn chord_columns(&self, chord: Chord) -> Amounts {
        let Chord { closest, from, to } = chord;
        if from < 0.0 && to > 0.0 {
            let (left, right) = (
                self.outward(closest, 0.0, -from),
                self.outward(closest, 0.0, to),
            );
            return std::array::from_fn(|k| left[k] + right[k]);
        }
        self.outward(closest, from.abs().min(to.abs()), from.abs().max(to.abs()))
    }

    /// Density integrals along a line that rises: panels whose altitude gains grow by three, 16 points each, and layers
    /// that are not exponential in closed form.
    fn outward(&self, closest: f64, from: f64, to: f64) -> Amounts {
        let mut sums = [0.0; MOST_LANES];
        let steepest = self.exponentials.iter().map(|e| e.1).fold(0.0, f64::max);
        if steepest > 0.0 {
            let (start, ground) = (closest.hypot(from), self.ground());
            let mut gain = 8.0 / steepest;
            let mut a = from;
            while a < to {
                let b = (from * from + gain * (2.0 * start + gain)).sqrt().min(to);
                let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
                for &(x, weight) in &inner_rule().points {
                    let t = middle + half * x;
                    let h = ((closest * closest + t * t).sqrt() - ground).max(0.0);
                    for &(k, fall) in &self.exponentials {
                        sums[k] += weight * half * (-h * fall).exp();
                    }
                }
                a = b;
                gain *= 3.0;
            }
        }
        if self.exponentials.len() < self.profiles.len() {
            for (sum, profile) in sums.iter_mut().zip(&self.profiles) {
                match *profile {
                    Profile::Exponential { .. } => {}
                    Profile::Tent { bottom, peak, top } => {
                        *sum = self.tent_outward([bottom, peak, top], closest, from, to);
                    }
                    Profile::Constant { bottom, top } => {
                        let [a, b] = [bottom, top].map(|h| self.crossing(h, closest, from, to));
                        *sum = b - a;
                    }
                }
            }
        }
        sums
    }

    /// Where a line that rises crosses an altitude; the nearer end where it does not.
    fn crossing(&self, h: f64, closest: f64, from: f64, to: f64) -> f64 {
        let half = half_chord(self.ground() + h, closest).unwrap_or(0.0);
        half.max(from).min(to)
    }

    /// Integral of a tent's density along a line that rises.
    fn tent_outward(&self, levels: [f64; 3], closest: f64, from: f64, to: f64) -> f64 {
        // Integral of the distance from the planet's centre over a part of the line.
        let turned = |a: f64, b: f64| {
            let (ra, rb) = (closest.hypot(a), closest.hypot(b));
            let round = if closest > 0.0 {
                // asinh(b / p) - asinh(a / p), without the difference of two large numbers.
                let rise = (b - a) * (b + a) / (ra + rb);
                closest * closest * ((b - a + rise) / (a + ra)).ln_1p()
            } else {
                0.0
            };
            0.5 * (b * rb - a * ra + round)
        };
        let edges = levels.map(|h| self.crossing(h, closest, from, to));
        let [bottom, peak, top] = levels;
        let mut sum = 0.0;
        if edges[1] > edges[0] {
            let below = turned(edges[0], edges[1]);
            sum += (below - (self.ground() + bottom) * (edges[1] - edges[0])) / (peak - bottom);
        }
        if edges[2] > edges[1] {
            let above = turned(edges[1], edges[2]);
            sum += ((self.ground() + top) * (edges[2] - edges[1]) - above) / (top - peak);
        }
        sum.max(0.0)
    }

    /// The same integrals as [`Sky::columns`] by another way: adaptive Gauss-Kronrod along the ray to a relative 1e-11.
    pub fn columns_adaptive(&self, h: f64, mu: f64, distance: f64) -> Amounts {
        let r = self.ground() + h;
        let lowest = -r * mu;
        let mut edges = vec![0.0, distance, lowest];
        for level in &self.bends {
            let square = lowest * lowest - r * r + level * level;
            edges.extend([lowest - square.abs().sqrt(), lowest + square.abs().sqrt()]);
        }
        edges.retain(|t| (0.0..=distance).contains(t));
        edges.sort_by(f64::total_cmp);
        let intervals: Vec<_> = edges.windows(2).map(|e| (e[0], e[1])).collect();
        let density = |t: f64| {
            // Altitude from the difference of squares, so that a small one keeps its digits.
            let square = h * (2.0 * self.ground() + h) + t * (t + 2.0 * r * mu);
            let ground = self.ground();
            self.densities(square / ((ground * ground + square).max(0.0).sqrt() + ground))
        };
        let tolerance = Tolerance {
            relative: 1e-11,
            absolute: 1e-7,
            panels: 200,
        };
        integrate_kronrod(density, &intervals, tolerance).value
    }

    /// Where a view ray runs through the air; `None` if it does not.
    pub(super) fn reach(&self, ray: &SkyRay) -> Option<Reach> {
        let r = self.ground() + ray.eye_altitude.max(0.0);
        let closest = r * ray.dir[0].hypot(ray.dir[2]);
        let start = r * ray.dir[1];
        let half = half_chord(self.top_radius(), closest)?;
        let near = (-half - start).max(0.0);
        let mut reach = Reach {
            chord: Chord {
                closest,
                from: 0.0,
                to: 0.0,
            },
            near,
            end: half - start,
            ground: false,
            space: true,
        };
        if let (true, Some(floor)) = (start < 0.0, half_chord(self.ground(), closest)) {
            reach.end = (-floor - start).max(0.0);
            (reach.ground, reach.space) = (true, false);
        }
        if ray.distance < reach.end {
            reach.end = ray.distance;
            (reach.ground, reach.space) = (false, false);
        }
        reach.chord.from = start + reach.near;
        reach.chord.to = start + reach.end;
        (reach.end > reach.near || reach.ground).then_some(reach)
    }

    /// Place of a point of the ray, from the planet's centre.
    pub(super) fn place(&self, ray: &SkyRay, t: f64) -> [f64; 3] {
        let eye = self.ground() + ray.eye_altitude.max(0.0);
        add([0.0, eye, 0.0], scale(ray.dir, t))
    }

    /// The line from a place (from the planet's centre) to the sun, up to the top; `None` in the planet's shadow.
    pub(super) fn sun_chord(&self, place: [f64; 3], to_sun: [f64; 3]) -> Option<Chord> {
        let chord = self.sun_line(place, to_sun);
        (chord.from >= 0.0 || chord.closest > self.ground()).then_some(chord)
    }

    /// The same line whether lit or not.
    fn sun_line(&self, place: [f64; 3], to_sun: [f64; 3]) -> Chord {
        let from = dot(place, to_sun);
        let closest = (dot(place, place) - from * from).max(0.0).sqrt();
        let to = half_chord(self.top_radius(), closest).unwrap_or(0.0);
        Chord {
            closest,
            from,
            to: to.max(from),
        }
    }

    /// Share of sunlight that reaches a place, per channel; 0 in the planet's shadow.
    pub(super) fn sunlight(&self, place: [f64; 3], to_sun: [f64; 3]) -> [f64; 3] {
        match self.sun_chord(place, to_sun) {
            Some(chord) => self.transmittance(self.chord_columns(chord)),
            None => [0.0; 3],
        }
    }

    /// Transmittance of columns.
    pub fn transmittance(&self, columns: Amounts) -> [f64; 3] {
        self.extinction(columns).map(|depth| (-depth).exp())
    }

    /// Scattering coefficients times phase functions, per channel.
    fn scattered(&self, densities: Amounts, nu: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for scatterer in &self.scatterers {
            let weight = densities[scatterer.profile] * scatterer.lobe.value(nu);
            for (sum, scattering) in sum.iter_mut().zip(scatterer.scattering) {
                *sum += scattering * weight;
            }
        }
        sum
    }

    /// Where a ray crosses the altitudes at which layers bend.
    pub(super) fn bends_along<'a>(&'a self, reach: &Reach) -> impl Iterator<Item = f64> + use<'a> {
        let Reach {
            chord, near, end, ..
        } = *reach;
        let start = chord.from - near;
        let halves = self.bends.iter();
        halves
            .filter_map(move |level| half_chord(*level, chord.closest))
            .flat_map(move |half| [-half - start, half - start])
            .filter(move |t| *t > near && *t < end)
    }

    /// The lit stretches of a ray, cut where the integrand bends: at the border of the planet's shadow, at the lowest point,
    /// where layers bend, and where the sun's rays graze those places. All in closed form.
    pub(super) fn lit_stretches(&self, ray: &SkyRay, reach: &Reach) -> Vec<(f64, f64)> {
        let r = self.ground() + ray.eye_altitude.max(0.0);
        let (d, s) = (ray.dir, ray.to_sun);
        let nu = dot(d, s);
        let mut cuts = vec![-r * d[1], -r * s[1] / nu];
        let mut levels = vec![self.ground()];
        levels.extend(&self.bends);
        let cross = [
            d[1] * s[2] - d[2] * s[1],
            d[2] * s[0] - d[0] * s[2],
            d[0] * s[1] - d[1] * s[0],
        ];
        let aside = r * s[0].hypot(s[2]);
        for level in levels {
            // The sun's ray through the point passes the centre at the distance `level`.
            cuts.extend(
                roots(
                    dot(cross, cross),
                    r * (d[1] - s[1] * nu),
                    (aside - level) * (aside + level),
                )
                .into_iter()
                .flatten(),
            );
        }
        cuts.extend(self.bends_along(reach));
        cuts.retain(|t| *t > reach.near && *t < reach.end);
        cuts.extend([reach.near, reach.end]);
        cuts.sort_by(f64::total_cmp);
        cuts.windows(2)
            .map(|pair| (pair[0], pair[1]))
            .filter(|(a, b)| b > a && self.sun_chord(self.place(ray, 0.5 * (a + b)), s).is_some())
            .collect()
    }

    /// What a stretch of the ray adds per metre, at a place that is lit.
    fn integrand(&self, ray: &SkyRay, reach: &Reach, t: f64) -> [f64; 3] {
        let place = self.place(ray, t);
        let offset = reach.chord.from - reach.near;
        let view = self.chord_columns(Chord {
            to: offset + t,
            ..reach.chord
        });
        let sun = self.chord_columns(self.sun_line(place, ray.to_sun));
        let light = self.transmittance(std::array::from_fn(|k| view[k] + sun[k]));
        let h = reach.chord.closest.hypot(offset + t) - self.ground();
        let scattered = self.scattered(self.densities(h), dot(ray.dir, ray.to_sun));
        std::array::from_fn(|k| light[k] * scattered[k])
    }

    /// Radiance of the ground at the end of a ray under the sun alone, as it reaches the eye.
    pub(super) fn reflected(
        &self,
        ray: &SkyRay,
        reach: &Reach,
        transmittance: [f64; 3],
    ) -> [f64; 3] {
        if !reach.ground {
            return [0.0; 3];
        }
        let place = self.place(ray, reach.end);
        let cosine = dot(place, ray.to_sun) / self.ground();
        if cosine <= 0.0 {
            return [0.0; 3];
        }
        let sun = self.sunlight(place, ray.to_sun);
        std::array::from_fn(|k| {
            transmittance[k] * lambert(self.atmosphere.ground_albedo[k], sun[k], cosine)
        })
    }

    /// Radiance of one scattering by adaptive Gauss-Kronrod quadrature, to the relative `tolerance` in every channel
    /// (1e-9 is reached; less than 1e-11 is rounding).
    pub fn single_scatter(&self, ray: &SkyRay, tolerance: f64) -> SkyRadiance {
        let Some(reach) = self.reach(ray) else {
            return SkyRadiance {
                in_scatter: [0.0; 3],
                error: [0.0; 3],
                reflected: [0.0; 3],
                transmittance: [1.0; 3],
                evaluations: 0,
            };
        };
        let estimate = integrate_kronrod(
            |t| self.integrand(ray, &reach, t),
            &self.lit_stretches(ray, &reach),
            Tolerance {
                relative: tolerance,
                absolute: 0.0,
                panels: 400,
            },
        );
        let transmittance = self.transmittance(self.chord_columns(reach.chord));
        SkyRadiance {
            in_scatter: estimate.value,
            error: estimate.error,
            reflected: self.reflected(ray, &reach, transmittance),
            transmittance,
            evaluations: estimate.evaluations,
        }
    }

    /// The same radiance by another way, for comparison: the shadow's border by bisection about the point where the ray is
    /// deepest in it, every lit stretch in a variable that is the cube root of the distance from its lowest end, composite
    /// Gauss-Legendre with `panels` panels of `order` points, columns by [`Sky::columns_adaptive`].
    pub fn single_scatter_composite(&self, ray: &SkyRay, panels: usize, order: usize) -> [f64; 3] {
        let Some(reach) = self.reach(ray) else {
            return [0.0; 3];
        };
        let ground = self.ground();
        let eye = ground + ray.eye_altitude.max(0.0);
        let nu = dot(ray.dir, ray.to_sun);
        let altitude = |t: f64| {
            let square =
                ray.eye_altitude.max(0.0) * (ground + eye) + t * (t + 2.0 * eye * ray.dir[1]);
            square / ((ground * ground + square).sqrt() + ground)
        };
        let sun_cosine = |t: f64| (eye * ray.to_sun[1] + t * nu) / (ground + altitude(t));
        // Height of the sun's ray above the ground where it is lowest; the point's own where it only rises.
        let pass = |t: f64| {
            let (h, mu) = (altitude(t), sun_cosine(t));
            if mu >= 0.0 {
                return h.max(0.0) + 1.0;
            }
            (ground + h) * ((1.0 - mu) * (1.0 + mu)).max(0.0).sqrt() - ground
        };
        let level_cuts = |edges: &mut Vec<f64>, value: &dyn Fn(f64) -> f64, middle: f64| {
            for (mut a, mut b) in [(reach.near, middle), (middle, reach.end)] {
                let sign = value(a) > 0.0;
                if sign == (value(b) > 0.0) {
                    continue;
                }
                for _ in 0..70 {
                    let half = 0.5 * (a + b);
                    if (value(half) > 0.0) == sign {
                        a = half;
                    } else {
                        b = half;
                    }
                }
                edges.push(0.5 * (a + b));
            }
        };
        // Both the altitude and the distance of the sun's line from the centre have one minimum on the line.
        let lowest_of = |value: &dyn Fn(f64) -> f64| {
            let (mut a, mut b) = (reach.near, reach.end);
            for _ in 0..90 {
                let (left, right) = ((2.0 * a + b) / 3.0, (a + 2.0 * b) / 3.0);
                if value(left) < value(right) {
                    b = right;
                } else {
                    a = left;
                }
            }
            0.5 * (a + b)
        };
        let line = |t: f64| {
            let mu = sun_cosine(t);
            (ground + altitude(t)) * ((1.0 - mu) * (1.0 + mu)).max(0.0).sqrt() - ground
        };
        let (low, deepest) = (lowest_of(&altitude), lowest_of(&line));
        let mut edges = vec![reach.near, reach.end, low];
        level_cuts(&mut edges, &sun_cosine, reach.near);
        level_cuts(&mut edges, &line, deepest);
        for level in self.bends.iter().map(|radius| radius - ground) {
            level_cuts(&mut edges, &|t| altitude(t) - level, low);
            level_cuts(&mut edges, &|t| line(t) - level, deepest);
        }
        edges.sort_by(f64::total_cmp);
        let rule = Rule::new(order);
        let entry = altitude(reach.near).max(0.0);
        let entry_mu = (eye * ray.dir[1] + reach.near) / (ground + entry);
        let mut total = [0.0; 3];
        for pair in edges.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            if b <= a || pass(0.5 * (a + b)) <= 0.0 {
                continue;
            }
            let (low, high) = if altitude(a) <= altitude(b) {
                (a, b)
            } else {
                (b, a)
            };
            let part: [f64; 3] = rule.composite(
                |u| {
                    let t = low + (high - low) * u * u * u;
                    let (h, mu) = (altitude(t).max(0.0), sun_cosine(t));
                    let out = {
                        let r = ground + h;
                        let square = (self.atmosphere.thickness - h) * (self.top_radius() + r)
                            + (r * mu) * (r * mu);
                        square.max(0.0).sqrt() - r * mu
                    };
                    let sun = self.columns_adaptive(h, mu, out);
                    let view = self.columns_adaptive(entry, entry_mu, t - reach.near);
                    let light = self.transmittance(std::array::from_fn(|k| sun[k] + view[k]));
                    let scattered = self.scattered(self.densities(h), nu);
                    let stretch = 3.0 * u * u * (b - a);
                    std::array::from_fn(|k| light[k] * scattered[k] * stretch)
                },
                0.0,
                1.0,
                panels,
            );
            for k in 0..3 {
                total[k] += part[k];
            }
        }
        total
    }
}
