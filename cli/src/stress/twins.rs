//! Every public function's f64 twin, called with the bits of a row, and what is particular about its arguments.

use veduta::reference::air_ray::{self, AirRay};
use veduta::reference::air_tables::{
    self, Moments, Scattered, SkyEye, SkyLook, SkyPlace, SkyTexel, SphereNode, SplitPhases, TopPath,
};
use veduta::reference::atmosphere::{Atmosphere, SkyLight};
use veduta::reference::clouds::{CloudLayer, CloudLight, CloudShape};
use veduta::reference::field::{self, Field, Ground};
use veduta::reference::fractal::warp;
use veduta::reference::globe::{self, Globe, GlobeGround};
use veduta::reference::noise::{Lattice2d, Lattice3d, simplex, worley};
use veduta::reference::phase::DropletPhase;
use veduta::reference::planet::{ShellSegment, Span};
use veduta::reference::terrain::{Rock, Terrain, TerrainHit, ThreeLights};
use veduta::reference::textbook::{self, AirLight};
use veduta::reference::{
    atmosphere, clouds, fractal, ground, hash, math, medium, noise, phase, planet, post,
    quadrature, terrain, tone_map,
};
use veduta_compose::header::{Bound, Interval, Spacing};

use super::airs;

/// The most numbers that a result has.
pub const MOST: usize = 16;

/// The numbers of a twin's result, in the order of the function's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values {
    numbers: [f64; MOST],
    count: usize,
}

impl Values {
    /// Up to [`MOST`] numbers.
    pub fn new(numbers: &[f64]) -> Values {
        let mut all = [0.0; MOST];
        for (to, from) in all.iter_mut().zip(numbers) {
            *to = *from;
        }
        Values {
            numbers: all,
            count: numbers.len().min(MOST),
        }
    }

    /// The numbers.
    pub fn get(&self) -> &[f64] {
        &self.numbers[..self.count]
    }
}

/// Functions that read textures, each with the test of `tests/all` that judges it on the device.
pub const ELSEWHERE: &[(&str, &str)] = &[
    (
        "veduta::terrain::sky_share::sky_share",
        "valleys_see_less_of_the_sky",
    ),
    (
        "veduta::clouds::tile::march_tile",
        "a_layer_from_its_tile_meets_the_march",
    ),
    (
        "veduta::clouds::tile::march_tile_orders",
        "thick_clouds_of_all_orders_meet_paths",
    ),
    (
        "veduta::clouds::tile::cloud_shadow",
        "shadows_of_clouds_meet_the_reference",
    ),
    (
        "veduta::clouds::tile::cells_at",
        "thick_clouds_of_all_orders_meet_paths",
    ),
    (
        "veduta::clouds::tile::tile_at",
        "a_layer_from_its_tile_meets_the_march",
    ),
    (
        "veduta::clouds::window::window_at",
        "windows_meet_the_march_near_and_far_from_the_origin",
    ),
    (
        "veduta::clouds::window::march_windows",
        "windows_meet_the_march_near_and_far_from_the_origin",
    ),
    (
        "veduta::clouds::window::window_cells_at",
        "light_of_all_orders_in_windows_meets_paths",
    ),
    (
        "veduta::clouds::window::march_windows_orders",
        "light_of_all_orders_in_windows_meets_paths",
    ),
    (
        "veduta::clouds::shape::map_weather",
        "clouds_under_a_weather_map_meet_the_reference",
    ),
    (
        "veduta::clouds::shape::mapped_density",
        "clouds_under_a_weather_map_meet_the_reference",
    ),
    (
        "veduta::terrain::clipmap::baked_height",
        "baked_heights_are_patches_between_heights_of_the_field",
    ),
    (
        "veduta::terrain::clipmap::clip_hit",
        "rays_over_baked_heights_meet_the_field",
    ),
    (
        "veduta::terrain::refine::found_hit",
        "a_long_lens_meets_crests_that_are_finer_than_texels",
    ),
    (
        "veduta::terrain::refine::field_sun_share",
        "pictures_far_from_the_origin_are_those_of_double_precision",
    ),
    (
        "veduta::terrain::refine::refined_hit",
        "rays_over_baked_heights_meet_the_field",
    ),
    (
        "veduta::terrain::relief::bare_land_at",
        "the_device_and_the_processor_read_maps_alike",
    ),
    (
        "veduta::terrain::relief::land_at",
        "the_sea_lies_over_the_land_on_the_device_as_on_the_processor",
    ),
    (
        "veduta::terrain::clipmap::sun_share",
        "the_sun_shines_where_the_ground_lets_it",
    ),
    (
        "veduta::atmosphere::columns::sun_depth",
        "row_a07_the_table_of_columns_is_right_at_every_height_and_angle",
    ),
    (
        "veduta::atmosphere::diffuse::diffuse_moments",
        "moments_of_diffuse_light_meet_paths",
    ),
    (
        "veduta::atmosphere::textbook::march_air_columns",
        "the_joint_march_meets_quadrature",
    ),
    (
        "veduta::atmosphere::irradiance::seen_radiance",
        "light_of_the_sky_on_planes_meets_paths",
    ),
    (
        "veduta::atmosphere::orders::order_moments",
        "moments_of_diffuse_light_meet_paths",
    ),
    (
        "veduta::atmosphere::scatter::air_source",
        "single_scattering_from_tables_meets_quadrature",
    ),
    (
        "veduta::atmosphere::scatter::scatter_along",
        "single_scattering_from_tables_meets_quadrature",
    ),
    (
        "veduta::atmosphere::sky_view::sky_radiance",
        "single_scattering_from_tables_meets_quadrature",
    ),
    (
        "veduta::atmosphere::scatter::space_transmittance",
        "air_before_things_is_that_of_the_probe_with_every_depth",
    ),
    (
        "veduta::atmosphere::transmittance::table_transmittance",
        "transmittance_of_the_table_meets_quadrature",
    ),
    (
        "veduta::atmosphere::sky_view::sky_seen",
        "what_the_sky_draws_is_what_the_probe_finds",
    ),
    (
        "veduta::atmosphere::sky_view::sky_seen_by_pair",
        "what_the_sky_draws_is_what_the_probe_finds",
    ),
    (
        "veduta::atmosphere::aerial::aerial_depth",
        "air_before_things_meets_quadrature",
    ),
    (
        "veduta::atmosphere::aerial::aerial_light",
        "air_before_things_meets_quadrature",
    ),
];

/// What is read from the columns of a row.
pub trait Argument: Sized {
    /// How many columns it takes.
    const COLUMNS: usize;

    /// The value of so many columns.
    fn read(bits: &[u32]) -> Self;
}

impl Argument for f64 {
    const COLUMNS: usize = 1;
    fn read(bits: &[u32]) -> f64 {
        f64::from(f32::from_bits(bits[0]))
    }
}

impl Argument for i32 {
    const COLUMNS: usize = 1;
    fn read(bits: &[u32]) -> i32 {
        bits[0].cast_signed()
    }
}

impl Argument for u32 {
    const COLUMNS: usize = 1;
    fn read(bits: &[u32]) -> u32 {
        bits[0]
    }
}

impl Argument for bool {
    const COLUMNS: usize = 1;
    fn read(bits: &[u32]) -> bool {
        bits[0] != 0
    }
}

/// An atmosphere that a column chooses.
#[derive(Debug, Clone, Copy)]
pub struct Air(&'static veduta::Atmosphere);

impl Argument for Air {
    const COLUMNS: usize = 1;
    fn read(bits: &[u32]) -> Air {
        Air(airs::chosen(bits[0]))
    }
}

impl<T: Argument, const N: usize> Argument for [T; N] {
    const COLUMNS: usize = N * T::COLUMNS;
    fn read(bits: &[u32]) -> [T; N] {
        std::array::from_fn(|k| T::read(&bits[k * T::COLUMNS..]))
    }
}

/// A structure of the references whose members are those of the module's.
macro_rules! argument {
    ($name:ident { $($member:ident: $ty:ty),+ $(,)? }) => {
        impl Argument for $name {
            const COLUMNS: usize = 0 $(+ <$ty as Argument>::COLUMNS)+;
            fn read(bits: &[u32]) -> $name {
                let mut rest = bits;
                $(let $member = take::<$ty>(&mut rest);)+
                $name { $($member),+ }
            }
        }
    };
}

fn take<T: Argument>(rest: &mut &[u32]) -> T {
    let value = T::read(rest);
    *rest = &rest[T::COLUMNS..];
    value
}

argument!(Terrain {
    cell: [i32; 2],
    frac: [f64; 2],
    wavelength: f64,
    amplitude: f64,
    hurst: f64,
    gain: f64,
    smoothness: f64,
    seed: u32
});
argument!(Field {
    cell: [i32; 2],
    frac: [f64; 2],
    wavelength: f64,
    amplitude: f64,
    base: f64,
    fall: f64,
    shape: f64,
    detail: f64,
    octaves: i32,
    seed: u32,
    mean: [f64; 4],
    lost: [f64; 4],
    sea: f64
});
argument!(Globe {
    cell: [i32; 3],
    wavelength: f64,
    frac: [f64; 3],
    amplitude: f64,
    up: [f64; 3],
    base: f64,
    ground_radius: f64,
    eye_altitude: f64,
    fall: f64,
    shape: f64,
    detail: f64,
    octaves: i32,
    seed: u32,
    sea: f64,
    mean: [f64; 4],
    lost: [f64; 4],
    low: f64,
    high: f64,
    steepest: f64,
    tallest: f64,
    steep: f64,
    steep_growth: f64
});
argument!(Rock {
    cell: [i32; 3],
    frac: [f64; 3],
    wavelength: f64,
    octaves: i32,
    hurst: f64,
    dark: [f64; 3],
    light: [f64; 3],
    stain: [f64; 3],
    seed: u32
});
argument!(ThreeLights {
    sun_color: [f64; 3],
    sky_color: [f64; 3],
    bounce_color: [f64; 3]
});
argument!(Atmosphere {
    ground_radius: f64,
    top: f64,
    rayleigh_scattering: [f64; 3],
    rayleigh_height: f64,
    mie_scattering: f64,
    mie_extinction: f64,
    mie_height: f64,
    mie_g: f64
});
argument!(SkyLight {
    in_scatter: [f64; 3],
    transmittance: [f64; 3]
});
argument!(ShellSegment {
    near: f64,
    far: f64,
    gap_near: f64,
    gap_far: f64
});
argument!(DropletPhase {
    sharp_gap: f64,
    broad_gap: f64,
    alpha: f64,
    broad_share: f64
});

argument!(AirRay {
    altitude: f64,
    mu: f64,
    sine: f64,
    nu: f64,
    sun_mu: f64,
    from_eye: f64,
    length: f64,
    dark_from: f64,
    dark_to: f64,
    meets_ground: u32
});

argument!(Moments {
    whole: [f64; 3],
    up: [f64; 3],
    level: [f64; 3],
    aside: [f64; 3]
});
argument!(Scattered {
    smooth_light: [f64; 3],
    peaked_light: [f64; 3],
    transmittance: [f64; 3]
});
argument!(SkyLook {
    to_sun: [f64; 3],
    horizon: f64,
    ahead: [f64; 2],
    above: f64,
    above_rise: f64,
    below: f64,
    below_rise: f64,
    gain: f64,
    peak_base: f64,
    peak_slope: f64,
    peak_level: f64,
    peak_square: f64
});
argument!(SkyEye {
    to_sun: [f64; 3],
    altitude: f64,
    horizon: f64,
    ground_radius: f64,
    top: f64,
    scale: f64,
    sun_angular_radius: f64,
    shows_ground: u32
});

impl Argument for CloudLight {
    const COLUMNS: usize = 5;
    fn read(bits: &[u32]) -> CloudLight {
        CloudLight {
            scatter: f64::read(bits),
            transmittance: f64::read(&bits[1..]),
            mean_distance: f64::read(&bits[2..]),
        }
    }
}

impl Argument for CloudLayer {
    const COLUMNS: usize = 16;
    fn read(bits: &[u32]) -> CloudLayer {
        let mut rest = bits;
        let turn: [u32; 3] = take(&mut rest);
        let turns_per_metre: f64 = take(&mut rest);
        let doublings: u32 = take(&mut rest);
        let fall: f64 = take(&mut rest);
        let d = doublings.clamp(1, 16);
        CloudLayer {
            cell: turn.map(|t| (t >> (32 - d)).cast_signed()),
            frac: turn.map(|t| f64::from(t << d) * 0.5_f64.powi(32)),
            wavelength: 1.0 / (turns_per_metre * f64::from(1_u32 << d)),
            period: 1 << d,
            octaves: 6,
            hurst: -fall.log2(),
            bottom: take(&mut rest),
            thickness: take(&mut rest),
            coverage: take(&mut rest),
            uniformity: take(&mut rest),
            extinction: take(&mut rest),
            albedo: take(&mut rest),
            g_forward: take(&mut rest),
            g_backward: take(&mut rest),
            backward_share: take(&mut rest),
            seed: take(&mut rest),
        }
    }
}

impl Argument for CloudShape {
    const COLUMNS: usize = 6;
    fn read(bits: &[u32]) -> CloudShape {
        let mut rest = bits;
        CloudShape {
            kind: take(&mut rest),
            kind_spread: take(&mut rest),
            coverage_spread: take(&mut rest),
            detail: take(&mut rest),
            sharpness: take(&mut rest),
            weather_doublings: take(&mut rest),
        }
    }
}

/// What becomes the numbers of a result.
pub trait Answer {
    /// The numbers.
    fn values(self) -> Values;
}

impl Answer for f64 {
    fn values(self) -> Values {
        Values::new(&[self])
    }
}

impl Answer for i32 {
    fn values(self) -> Values {
        Values::new(&[f64::from(self)])
    }
}

impl Answer for Moments {
    fn values(self) -> Values {
        Values::new(&[self.whole, self.up, self.level, self.aside].concat())
    }
}

impl Answer for SplitPhases {
    fn values(self) -> Values {
        Values::new(&[self.smooth_lanes, self.peaked_lanes].concat())
    }
}

impl Answer for SkyPlace {
    fn values(self) -> Values {
        let below = f64::from(u8::from(self.below));
        Values::new(&[self.x, self.y, below, self.nu, self.reach])
    }
}

impl Answer for SkyTexel {
    fn values(self) -> Values {
        Values::new(&[self.at[0], self.at[1], self.nu])
    }
}

impl Answer for u32 {
    fn values(self) -> Values {
        Values::new(&[f64::from(self)])
    }
}

impl<const N: usize> Answer for [f64; N] {
    fn values(self) -> Values {
        Values::new(&self)
    }
}

impl<const N: usize> Answer for [u32; N] {
    fn values(self) -> Values {
        Values::new(&self.map(f64::from))
    }
}

impl<const N: usize> Answer for [i32; N] {
    fn values(self) -> Values {
        Values::new(&self.map(f64::from))
    }
}

impl Answer for Lattice2d {
    fn values(self) -> Values {
        let [a, b] = self.cell.map(f64::from);
        Values::new(&[a, b, self.frac[0], self.frac[1]])
    }
}

impl Answer for Lattice3d {
    fn values(self) -> Values {
        let [a, b, c] = self.cell.map(f64::from);
        Values::new(&[a, b, c, self.frac[0], self.frac[1], self.frac[2]])
    }
}

impl Answer for Span {
    fn values(self) -> Values {
        Values::new(&[self.near, self.far])
    }
}

impl Answer for ShellSegment {
    fn values(self) -> Values {
        Values::new(&[self.near, self.far, self.gap_near, self.gap_far])
    }
}

impl Answer for DropletPhase {
    fn values(self) -> Values {
        Values::new(&[self.sharp_gap, self.broad_gap, self.alpha, self.broad_share])
    }
}

impl Answer for SkyLight {
    fn values(self) -> Values {
        let ([a, b, c], [d, e, f]) = (self.in_scatter, self.transmittance);
        Values::new(&[a, b, c, d, e, f])
    }
}

impl Answer for AirRay {
    fn values(self) -> Values {
        Values::new(&[
            self.altitude,
            self.mu,
            self.sine,
            self.nu,
            self.sun_mu,
            self.from_eye,
            self.length,
            self.dark_from,
            self.dark_to,
            f64::from(self.meets_ground),
        ])
    }
}

impl Answer for SphereNode {
    fn values(self) -> Values {
        Values::new(&[self.mu, self.cos_phi, self.solid])
    }
}

impl Answer for TopPath {
    fn values(self) -> Values {
        Values::new(&[self.lowest, self.along, self.rises, self.falls])
    }
}

impl Answer for AirLight {
    fn values(self) -> Values {
        let ([a, b, c], [d, e, f]) = (self.in_scatter, self.transmittance);
        Values::new(&[a, b, c, d, e, f])
    }
}

impl Answer for CloudLight {
    /// The samples taken are not the twin's.
    fn values(self) -> Values {
        Values::new(&[
            self.scatter,
            self.transmittance,
            self.mean_distance,
            0.0,
            0.0,
        ])
    }
}

impl Answer for TerrainHit {
    fn values(self) -> Values {
        Values::new(&[
            self.distance,
            self.reached,
            self.clearance,
            f64::from(self.steps),
        ])
    }
}

impl Answer for Ground {
    fn values(self) -> Values {
        let [x, z] = self.slope;
        Values::new(&[self.height, x, z, self.lost])
    }
}

impl Answer for GlobeGround {
    fn values(self) -> Values {
        let [x, y, z] = self.slope;
        Values::new(&[self.height, x, y, z, self.lost])
    }
}

impl Answer for (f64, i32) {
    fn values(self) -> Values {
        Values::new(&[self.0, f64::from(self.1)])
    }
}

/// A function of the references that can be called with the bits of a row.
pub trait Twin<A> {
    /// The columns that it reads.
    const COLUMNS: usize;

    /// Its result.
    fn call(&self, row: &[u32]) -> Values;
}

macro_rules! twin_of {
    ($($argument:ident),*) => {
        impl<Function, Result, $($argument),*> Twin<($($argument,)*)> for Function
        where
            Function: Fn($($argument),*) -> Result,
            Result: Answer,
            $($argument: Argument,)*
        {
            const COLUMNS: usize = 0 $(+ $argument::COLUMNS)*;

            #[allow(non_snake_case, unused_mut, unused_variables)]
            fn call(&self, row: &[u32]) -> Values {
                let mut rest = row;
                $(let $argument = take::<$argument>(&mut rest);)*
                self($($argument),*).values()
            }
        }
    };
}

twin_of!();
twin_of!(A);
twin_of!(A, B);
twin_of!(A, B, C);
twin_of!(A, B, C, D);
twin_of!(A, B, C, D, E);
twin_of!(A, B, C, D, E, F);
twin_of!(A, B, C, D, E, F, G);
twin_of!(A, B, C, D, E, F, G, H);
twin_of!(A, B, C, D, E, F, G, H, I);
twin_of!(A, B, C, D, E, F, G, H, I, J);
twin_of!(A, B, C, D, E, F, G, H, I, J, K);
twin_of!(A, B, C, D, E, F, G, H, I, J, K, L);
twin_of!(A, B, C, D, E, F, G, H, I, J, K, L, M);

/// A domain that the header does not give, or a part of the header's that is sampled.
#[derive(Debug, Clone)]
pub struct OwnDomain {
    /// The parameter or member.
    pub name: &'static str,
    /// The values.
    pub interval: Interval,
    /// How samples are spread.
    pub spacing: Spacing,
}

/// How raw columns become arguments that belong together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prepare {
    /// A vector is made a unit vector.
    Unit(&'static str),
    /// Numbers are put in order, the smallest first.
    Ascending(&'static [&'static str]),
    /// Numbers are rounded to whole ones.
    Whole(&'static str),
    /// An eye's horizon follows from its altitude and the ground's radius.
    Horizon(&'static str),
}

impl Prepare {
    /// As a half sentence.
    pub fn describe(&self) -> String {
        match self {
            Prepare::Unit(name) => format!("{name} a unit vector"),
            Prepare::Whole(name) => format!("{name} whole"),
            Prepare::Horizon(name) => format!("{name}.horizon where it is"),
            Prepare::Ascending(names) => format!("{} ascending", names.join(", ")),
        }
    }
}

/// Changes the device's numbers into those that are compared with the twin's.
pub type Align = fn(&mut [f64], &[f64]);

/// A quantity of energy and its bound, from the arguments and the device's numbers.
pub type Energy = fn(&[u32], &[f64]) -> (f64, f64);

type Call = Box<dyn Fn(&[u32]) -> Values + Send + Sync>;

/// A public function with its twin.
pub struct Entry {
    /// The function's full name.
    pub path: &'static str,
    /// The twin's, as the header names it.
    pub reference: &'static str,
    /// The columns that the twin reads.
    pub columns: usize,
    /// Domains beside those of the header.
    pub domains: Vec<OwnDomain>,
    /// Where a parameter's branches are.
    pub branches: Vec<(&'static str, Vec<f64>)>,
    /// What is done to the columns.
    pub prepare: Vec<Prepare>,
    /// Where the twin jumps or bends, and how far arguments may be off there, as a share of their size (at least 1).
    pub jumps: Option<(&'static str, f64)>,
    /// The members of the result that range and error hold for; none: all.
    pub judged: Option<&'static [&'static str]>,
    /// Before comparing.
    pub align: Option<Align>,
    /// The bound of energy.
    pub energy: Option<Energy>,
    /// Cost of one evaluation, that of a cheap function being 1.
    pub weight: f64,
    call: Call,
}

impl std::fmt::Debug for Entry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Entry")
            .field("path", &self.path)
            .field("reference", &self.reference)
            .finish_non_exhaustive()
    }
}

impl Entry {
    fn new<A, T: Twin<A> + Send + Sync + 'static>(
        path: &'static str,
        reference: &'static str,
        twin: T,
    ) -> Entry {
        Entry {
            path,
            reference,
            columns: T::COLUMNS,
            domains: Vec::new(),
            branches: Vec::new(),
            prepare: Vec::new(),
            jumps: None,
            judged: None,
            align: None,
            energy: None,
            weight: 1.0,
            call: Box::new(move |row| twin.call(row)),
        }
    }

    /// The twin's numbers for a row.
    pub fn call(&self, row: &[u32]) -> Values {
        (self.call)(row)
    }

    fn domain(mut self, name: &'static str, lo: f64, hi: f64, spacing: Spacing) -> Entry {
        self.domains.retain(|d| d.name != name);
        self.domains.push(OwnDomain {
            name,
            interval: Interval {
                lo: Bound::Number(lo),
                hi: Bound::Number(hi),
                lo_open: false,
                hi_open: false,
                unit: "1".to_owned(),
            },
            spacing,
        });
        self
    }

    fn lin(self, name: &'static str, lo: f64, hi: f64) -> Entry {
        self.domain(name, lo, hi, Spacing::Lin)
    }

    fn log(self, name: &'static str, lo: f64, hi: f64) -> Entry {
        self.domain(name, lo, hi, Spacing::Log)
    }

    fn branch(mut self, name: &'static str, at: &[f64]) -> Entry {
        self.branches.push((name, at.to_vec()));
        self
    }

    fn unit(mut self, name: &'static str) -> Entry {
        self.prepare.push(Prepare::Unit(name));
        self
    }

    fn horizon(mut self, name: &'static str) -> Entry {
        self.prepare.push(Prepare::Horizon(name));
        self
    }

    fn ascending(mut self, names: &'static [&'static str]) -> Entry {
        self.prepare.push(Prepare::Ascending(names));
        self
    }

    fn jumps(mut self, at: &'static str, share: f64) -> Entry {
        self.jumps = Some((at, share));
        self
    }

    fn judged(mut self, members: &'static [&'static str]) -> Entry {
        self.judged = Some(members);
        self
    }

    fn align(mut self, align: Align) -> Entry {
        self.align = Some(align);
        self
    }

    fn energy(mut self, energy: Energy) -> Entry {
        self.energy = Some(energy);
        self
    }

    fn weight(mut self, weight: f64) -> Entry {
        self.weight = weight;
        self
    }

    /// The domains of a terrain that the promises of errors are for: mountains of 1 m to 1400 m.
    fn terrain(self) -> Entry {
        self.lin("terrain.cell", -2_147_483_648.0, 2_147_483_647.0)
            .lin("terrain.frac", 0.0, 1.0)
            .log("terrain.wavelength", 8192.0, 65536.0)
            .lin("terrain.amplitude", 1.0, 1400.0)
            .lin("terrain.hurst", 1.0, 2.0)
            .lin("terrain.gain", 0.0, 2.0)
            .lin("terrain.smoothness", 0.0, 1.0)
    }

    /// The domains of a height field that the promises of errors are for.
    fn field(self) -> Entry {
        self.lin("field.cell", -2_147_483_648.0, 2_147_483_647.0)
            .lin("field.frac", 0.0, 1.0)
            .log("field.wavelength", 8192.0, 65536.0)
            .lin("field.amplitude", 1.0, 1400.0)
            .lin("field.base", -1000.0, 1000.0)
            .lin("field.fall", 0.3, 0.5)
            .lin("field.shape", 1.0, 2.0)
            .lin("field.detail", 0.0, 1.0)
            .lin("field.octaves", 1.0, 12.0)
            .lin("field.mean", 0.1, 0.5)
            .lin("field.lost", 0.1, 0.5)
            .lin("field.sea", -1e5, -1e4)
    }

    /// The domains of a height field on a ball that the promises of errors are for.
    fn globe(self) -> Entry {
        self.lin("globe.cell", -2_147_483_648.0, 2_147_483_647.0)
            .lin("globe.frac", 0.0, 1.0)
            .log("globe.wavelength", 32_768.0, 262_144.0)
            .lin("globe.amplitude", 1.0, 1400.0)
            .lin("globe.base", -1000.0, 1000.0)
            .lin("globe.up", -1.0, 1.0)
            .unit("globe.up")
            .log("globe.ground_radius", 1.7e6, 7e6)
            .lin("globe.eye_altitude", 0.0, 2e5)
            .lin("globe.fall", 0.3, 0.5)
            .lin("globe.shape", 0.0, 1.0)
            .lin("globe.detail", 0.0, 1.0)
            .lin("globe.octaves", 1.0, 8.0)
            .lin("globe.sea", -1e5, -1e4)
            .lin("globe.mean", 0.1, 0.5)
            .lin("globe.lost", 0.1, 0.5)
            .lin("globe.low", -1e4, -1e3)
            .lin("globe.high", 1e3, 1e4)
            .lin("globe.steepest", 0.0, 10.0)
            .lin("globe.tallest", 0.0, 2.0)
            .lin("globe.steep", 0.0, 10.0)
            .lin("globe.steep_growth", 0.5, 2.0)
    }

    fn rock(self) -> Entry {
        self.lin("rock.cell", -2_147_483_648.0, 2_147_483_647.0)
            .lin("rock.frac", 0.0, 1.0)
            .log("rock.wavelength", 32.0, 1000.0)
            .lin("rock.octaves", 1.0, 6.0)
            .lin("rock.hurst", 1.0, 2.0)
            .lin("rock.dark", 0.0, 1.0)
            .lin("rock.light", 0.0, 1.0)
            .lin("rock.stain", 0.0, 1.0)
    }

    fn air(self) -> Entry {
        self.log("atmosphere.ground_radius", 3e6, 1e8)
            .lin("atmosphere.top", 1.1e5, 1.2e5)
            .log("atmosphere.rayleigh_scattering", 1e-6, 1e-4)
            .lin("atmosphere.rayleigh_height", 4e3, 1.6e4)
            .log("atmosphere.mie_scattering", 1e-7, 1e-4)
            .log("atmosphere.mie_extinction", 1e-7, 1e-4)
            .lin("atmosphere.mie_height", 1400.0, 4e3)
            .lin("atmosphere.mie_g", -0.9, 0.9)
            .ascending(&["atmosphere.mie_scattering", "atmosphere.mie_extinction"])
    }

    fn ray(self) -> Entry {
        self.lin("ray.altitude", 0.0, 1e5)
            .lin("ray.mu", -1.0, 1.0)
            .lin("ray.sine", 0.0, 1.0)
            .lin("ray.nu", -1.0, 1.0)
            .lin("ray.sun_mu", -1.0, 1.0)
            .lin("ray.from_eye", 0.0, 1e8)
            .lin("ray.length", 0.0, 1.2e6)
            .lin("ray.dark_from", 0.0, 1.2e6)
            .lin("ray.dark_to", 0.0, 1.2e6)
            .lin("ray.meets_ground", 0.0, 1.0)
    }

    /// An eye anywhere, and the sun.
    fn eye(self) -> Entry {
        self.log("eye.altitude", 1.0, 1e8)
            .branch("eye.altitude", &[1e4, 1e5, 3.6e7])
            .log("eye.horizon", 1.0, 40.0)
            .log("eye.ground_radius", 3e6, 1e7)
            .lin("eye.top", 5e4, 2e5)
            .log("eye.scale", 1.0, 1e6)
            .lin("eye.sun_angular_radius", 0.0, 0.1)
            .lin("eye.shows_ground", 0.0, 1.0)
            .lin("eye.to_sun", -1.0, 1.0)
            .unit("eye.to_sun")
            .horizon("eye")
    }

    fn layer(self) -> Entry {
        self.log("layer.turns_per_metre", 1e-5, 1e-4)
            .lin("layer.period_doublings", 1.0, 4.0)
            .lin("layer.fall", 0.25, 1.0)
            .lin("layer.bottom", 4000.0, 4000.0)
            .lin("layer.thickness", 1500.0, 1500.0)
            .lin("layer.coverage", 0.25, 1.0)
            .lin("layer.uniformity", 0.0, 1.0)
            .lin("layer.extinction", 0.0, 0.06)
            .lin("layer.albedo", 0.0, 1.0)
            .lin("layer.g_forward", 0.0, 0.9)
            .lin("layer.g_backward", -0.9, 0.0)
            .lin("layer.backward_share", 0.0, 1.0)
    }
}

/// Entries of functions whose twins have their names and their arguments.
macro_rules! same {
    ($list:ident, $module:literal, $reference:literal, $twins:ident, $($name:ident),+ $(,)?) => {
        $($list.push(Entry::new(
            concat!("veduta::", $module, "::", stringify!($name)),
            concat!("reference::", $reference, "::", stringify!($name)),
            $twins::$name,
        ));)+
    };
}

/// An entry whose twin is called through a closure.
macro_rules! other {
    ($list:ident, $path:literal, $reference:literal, $twin:expr) => {
        $list.push(Entry::new(
            concat!("veduta::", $path),
            concat!("reference::", $reference),
            $twin,
        ))
    };
}

/// Cells that differ by one mean the same place when the fractions lie at either end.
fn same_place<const N: usize>(device: &mut [f64], truth: &[f64]) {
    for axis in 0..N {
        let steps = device[axis] - truth[axis];
        // Cells wrap at 2^32.
        let steps = steps - 2_f64.powi(32) * (steps * 0.5_f64.powi(32)).round();
        if steps.abs() <= 1.0 {
            device[axis] = truth[axis];
            device[N + axis] += steps;
        }
    }
}

/// Turns wrap at 2^32.
fn same_turn(device: &mut [f64], truth: &[f64]) {
    for (d, t) in device.iter_mut().zip(truth) {
        *d -= 2_f64.powi(32) * ((*d - t) * 0.5_f64.powi(32)).round();
    }
}

/// Light scattered once is at most what the ray has lost, times the largest of the phase functions.
fn sky_energy(row: &[u32], found: &[f64]) -> (f64, f64) {
    let mut rest = row;
    let air: Atmosphere = take(&mut rest);
    let _altitude: f64 = take(&mut rest);
    let (dir, to_sun): ([f64; 3], [f64; 3]) = (take(&mut rest), take(&mut rest));
    let nu = math::dot(dir, to_sun).clamp(-1.0, 1.0);
    let largest = phase::phase_rayleigh(nu).max(phase::phase_cornette_shanks(nu, air.mie_g));
    let excess = (0..3)
        .map(|c| found[c] - largest * (1.0 - found[3 + c]))
        .fold(f64::NEG_INFINITY, f64::max);
    (excess, 1e-5 * largest.max(1.0))
}

/// Light scattered once is at most the loss times albedo and phase function, and half a step's depth more.
fn cloud_energy(row: &[u32], found: &[f64]) -> (f64, f64) {
    let mut rest = row;
    let layer: CloudLayer = take(&mut rest);
    let ground_radius: f64 = take(&mut rest);
    let eye: f64 = take(&mut rest);
    let (dir, to_sun): ([f64; 3], [f64; 3]) = (take(&mut rest), take(&mut rest));
    let farthest: f64 = take(&mut rest);
    let steps: i32 = take(&mut rest);
    let nu = math::dot(dir, to_sun).clamp(-1.0, 1.0);
    let phase = phase::phase_double_henyey_greenstein(
        nu,
        layer.g_forward,
        layer.g_backward,
        layer.backward_share,
    );
    let top = layer.bottom + layer.thickness;
    let whole = planet::shell_segment(ground_radius, layer.bottom, top, eye, dir[1]);
    let size = planet::segment_length(planet::clip_segment(whole, farthest));
    let depth = layer.extinction * size / f64::from(steps.max(1));
    let excess = 1.0 / math::one_minus_exp_over_x(depth.max(1e-12));
    let bound = layer.albedo * phase * (1.0 - found[1]) * excess;
    (found[0], bound * 1.001 + 2e-4)
}

/// Every public function, one entry each.
pub fn registry() -> Vec<Entry> {
    let mut list: Vec<Entry> = Vec::new();
    same!(
        list,
        "hash::pcg",
        "hash",
        hash,
        pcg,
        pcg_2d_keyed,
        pcg_2d,
        pcg_3d_keyed,
        pcg_3d,
        pcg_4d,
        unit_float,
        signed_float
    );
    same!(
        list,
        "hash::lattice",
        "hash",
        hash,
        lattice_hash_2d,
        lattice_hash_3d,
        lattice_word_3d,
        hash_xor_2d,
        hash_xor_3d,
        hash_linear_2d,
        hash_linear_3d,
        hash_nested_2d,
        hash_nested_3d,
        hash_source_2d
    );
    same!(
        list,
        "noise::lattice",
        "noise",
        noise,
        octave_frequency,
        octave_fall,
        octave_seed,
        wrap_2d,
        wrap_3d
    );
    same!(list, "noise::lattice", "noise", noise, split_2d, octave_2d);
    same!(list, "noise::lattice", "noise", noise, split_3d, octave_3d);
    same!(list, "noise::lattice", "noise", noise, turn_3d);
    other!(
        list,
        "noise::lattice::fade_2d",
        "noise::fade",
        |t: [f64; 2]| t.map(noise::fade)
    );
    other!(
        list,
        "noise::lattice::fade_3d",
        "noise::fade",
        |t: [f64; 3]| t.map(noise::fade)
    );
    other!(
        list,
        "noise::lattice::fade_fraction_3d",
        "noise::fade_fraction",
        |fraction: [u32; 3]| fraction.map(noise::fade_fraction)
    );
    other!(
        list,
        "noise::lattice::fade_slope_2d",
        "noise::fade_slope",
        |t: [f64; 2]| t.map(noise::fade_slope)
    );
    other!(
        list,
        "noise::lattice::fade_slope_3d",
        "noise::fade_slope",
        |t: [f64; 3]| t.map(noise::fade_slope)
    );
    same!(
        list,
        "noise::value",
        "noise",
        noise,
        value_noise_2d,
        value_noise_3d,
        value_noise_2d_slope,
        value_noise_3d_slope,
        value_noise_2d_periodic,
        value_noise_3d_periodic,
        value_noise_2d_periodic_slope,
        value_noise_3d_periodic_slope
    );
    same!(
        list,
        "noise::gradient",
        "noise",
        noise,
        lattice_gradient_2d,
        lattice_gradient_3d,
        gradient_noise_2d,
        gradient_noise_3d,
        gradient_noise_2d_slope,
        gradient_noise_3d_slope,
        gradient_noise_2d_periodic,
        gradient_noise_3d_periodic,
        gradient_noise_2d_periodic_slope,
        gradient_noise_3d_periodic_slope
    );
    same!(
        list,
        "noise::simplex",
        "noise::simplex",
        simplex,
        simplex_noise_2d,
        simplex_noise_3d,
        simplex_noise_2d_slope,
        simplex_noise_3d_slope,
        simplex_noise_2d_periodic,
        simplex_noise_3d_periodic,
        simplex_noise_2d_periodic_slope,
        simplex_noise_3d_periodic_slope
    );
    same!(
        list,
        "noise::worley",
        "noise::worley",
        worley,
        cell_point_2d,
        cell_point_3d,
        worley_noise_2d,
        worley_noise_3d,
        worley_noise_2d_slope,
        worley_noise_3d_slope,
        worley_second_2d_slope,
        worley_second_3d_slope,
        worley_noise_2d_periodic,
        worley_noise_3d_periodic,
        worley_noise_2d_periodic_slope,
        worley_noise_3d_periodic_slope,
        worley_second_2d_periodic_slope,
        worley_second_3d_periodic_slope
    );
    same!(
        list,
        "fractal::fbm",
        "fractal",
        fractal,
        fbm_2d,
        fbm_3d,
        fbm_2d_slope,
        fbm_3d_slope,
        fbm_value_3d,
        fbm_value_3d_periodic,
        fbm_value_3d_torus_six
    );
    same!(
        list,
        "fractal::hybrid",
        "fractal",
        fractal,
        hybrid_multifractal_2d,
        hybrid_multifractal_2d_slope
    );
    same!(
        list,
        "fractal::ridged",
        "fractal",
        fractal,
        smooth_abs,
        ridged_multifractal_2d,
        ridged_multifractal_2d_slope,
        ridged_multifractal_printed_2d
    );
    same!(
        list,
        "fractal::warp",
        "fractal::warp",
        warp,
        warped_slope_2d,
        warped_slope_3d,
        warped_fbm_2d,
        warped_fbm_3d,
        warped_fbm_2d_slope,
        warped_fbm_3d_slope
    );
    same!(list, "math::cubic", "math", math, cubic_weights);
    same!(
        list,
        "math::series",
        "math",
        math,
        one_minus_exp_over_x,
        one_minus_exp
    );
    same!(
        list,
        "medium::transmittance",
        "medium",
        medium,
        beer_lambert,
        step_integral
    );
    same!(
        list,
        "post::dither",
        "post",
        post,
        bayer_8x8,
        blue_mask,
        dither
    );
    same!(list, "post::srgb", "post", post, encode_srgb, decode_srgb);
    same!(list, "post::display", "post", post, displayed);
    same!(
        list,
        "post::temporal",
        "post",
        post,
        catmull_rom,
        pixel_share,
        box_share
    );
    same!(
        list,
        "tone_map::aces",
        "tone_map",
        tone_map,
        aces_hill,
        aces_narkowicz
    );
    same!(
        list,
        "tone_map::agx",
        "tone_map",
        tone_map,
        agx_sigmoid,
        agx
    );
    same!(
        list,
        "tone_map::exponential",
        "tone_map",
        tone_map,
        exponential
    );
    same!(list, "tone_map::neutral", "tone_map", tone_map, neutral);
    same!(
        list,
        "tone_map::reinhard",
        "tone_map",
        tone_map,
        reinhard,
        reinhard_extended
    );
    same!(
        list,
        "lighting::phase",
        "phase",
        phase,
        phase_isotropic,
        phase_rayleigh,
        phase_henyey_greenstein,
        phase_double_henyey_greenstein,
        phase_schlick,
        phase_cornette_shanks,
        phase_draine,
        droplet_phase,
        phase_droplets,
        phase_henyey_greenstein_draine
    );
    same!(
        list,
        "planet::shell",
        "planet",
        planet,
        altitude_along,
        altitude_of,
        up_at,
        direction_cosine_along,
        sphere_span,
        top_distance,
        ground_distance,
        shell_segment,
        clip_segment,
        segment_length,
        segment_distance
    );
    other!(
        list,
        "atmosphere::march::air_density",
        "atmosphere::air_density",
        |a: Atmosphere, h: f64| atmosphere::air_density(&a, h)
    );
    other!(
        list,
        "atmosphere::march::air_column",
        "atmosphere::air_column",
        |a: Atmosphere, h: f64, mu: f64, steps: i32| atmosphere::air_column(&a, h, mu, steps)
    );
    other!(
        list,
        "atmosphere::march::sun_transmittance",
        "atmosphere::sun_transmittance",
        |a: Atmosphere, h: f64, mu: f64, steps: i32| atmosphere::sun_transmittance(
            &a, h, mu, steps
        )
    );
    other!(
        list,
        "atmosphere::march::march_sky",
        "atmosphere::march_sky",
        |a: Atmosphere,
         h: f64,
         dir: [f64; 3],
         to_sun: [f64; 3],
         distance: f64,
         steps: i32,
         light_steps: i32| {
            atmosphere::march_sky(&a, h, dir, to_sun, distance, steps, light_steps)
        }
    );
    same!(
        list,
        "atmosphere::sun_disc",
        "atmosphere",
        atmosphere,
        sun_disc,
        disc_in_pixel
    );
    same!(
        list,
        "atmosphere::ray",
        "air_ray",
        air_ray,
        zenith_parts,
        tangent_altitude,
        ray_inside,
        air_ray
    );
    other!(
        list,
        "atmosphere::ray::ray_altitude",
        "air_ray::ray_altitude",
        |radius: f64, ray: AirRay, t: f64| air_ray::ray_altitude(radius, &ray, t)
    );
    other!(
        list,
        "atmosphere::ray::ray_sun_cosine",
        "air_ray::ray_sun_cosine",
        |radius: f64, ray: AirRay, altitude: f64, t: f64| air_ray::ray_sun_cosine(
            radius, &ray, altitude, t
        )
    );
    other!(
        list,
        "atmosphere::ray::lowest_distance",
        "air_ray::lowest_distance",
        |radius: f64, ray: AirRay| air_ray::lowest_distance(radius, &ray)
    );
    other!(
        list,
        "atmosphere::textbook::march_sun_depth",
        "textbook::march_sun_depth",
        |air: Air, h: f64, sun_mu: f64, steps: i32| textbook::march_sun_depth(
            air.0, h, sun_mu, steps
        )
    );
    other!(
        list,
        "atmosphere::textbook::march_air",
        "textbook::march_air",
        |air: Air, ray: AirRay, steps: i32, light_steps: i32| textbook::march_air(
            air.0,
            &ray,
            steps,
            light_steps
        )
    );
    other!(
        list,
        "atmosphere::medium::air_densities",
        "medium::air_densities",
        |air: Air, h: f64| medium::air_densities(air.0, h)
    );
    other!(
        list,
        "atmosphere::medium::air_extinction",
        "medium::air_extinction",
        |air: Air, amounts: [f64; 8]| medium::air_extinction(air.0, amounts)
    );
    other!(
        list,
        "atmosphere::medium::air_scattering",
        "medium::air_scattering",
        |air: Air, amounts: [f64; 8], weights: [f64; 8]| medium::air_scattering(
            air.0, amounts, weights
        )
    );
    other!(
        list,
        "atmosphere::medium::air_phases",
        "medium::air_phases",
        |air: Air, nu: f64| medium::air_phases(air.0, nu)
    );
    other!(
        list,
        "atmosphere::medium::peak_phase",
        "medium::peak_phase",
        |air: Air, nu: f64| medium::peak_phase(air.0, nu)
    );
    same!(
        list,
        "math::gauss",
        "quadrature",
        quadrature,
        gauss_four,
        gauss_five
    );
    same!(
        list,
        "math::squared",
        "quadrature",
        quadrature,
        squared_node
    );
    same!(
        list,
        "atmosphere::columns",
        "air_tables",
        air_tables,
        horizon_cosine,
        column_coordinates,
        column_place,
        path_to_top,
        texture_place,
        texel_coordinates,
        sun_above_horizon
    );
    other!(
        list,
        "atmosphere::transmittance::transmittance_code",
        "air_tables::transmittance_code",
        |air: Air, h: f64, mu: f64| air_tables::transmittance_code(air.0, h, mu)
    );
    same!(
        list,
        "atmosphere::transmittance",
        "air_tables",
        air_tables,
        transmittance_coordinates,
        transmittance_place
    );
    other!(
        list,
        "atmosphere::irradiance::sphere_node",
        "air_tables::sphere_node",
        air_tables::sphere_node
    );
    other!(
        list,
        "atmosphere::columns::column_scale",
        "air_tables::column_scale",
        |air: Air, h: f64, mu: f64| air_tables::column_scale(air.0, h, mu)
    );
    other!(
        list,
        "atmosphere::columns::column_code",
        "air_tables::column_code",
        |air: Air, h: f64, mu: f64| air_tables::column_code(air.0, h, mu)
    );
    other!(
        list,
        "atmosphere::columns::columns_to_top",
        "air_tables::columns_to_top",
        |air: Air, h: f64, mu: f64| air_tables::columns_to_top(air.0, h, mu)
    );
    same!(
        list,
        "atmosphere::diffuse",
        "air_tables",
        air_tables,
        diffuse_coordinates,
        diffuse_place,
        encode_moments,
        decode_moments,
        level_irradiance,
        plane_irradiance,
        add_moments
    );
    other!(
        list,
        "atmosphere::diffuse::diffuse_source",
        "air_tables::diffuse_source",
        |air: Air, densities: [f64; 8], moments: Moments, mu: f64, sun_mu: f64, nu: f64| {
            air_tables::diffuse_source(air.0, densities, moments, mu, sun_mu, nu)
        }
    );
    same!(
        list,
        "atmosphere::orders",
        "air_tables",
        air_tables,
        further_orders
    );
    other!(
        list,
        "atmosphere::scatter::split_phases",
        "air_tables::split_phases",
        |air: Air, nu: f64| air_tables::split_phases(air.0, nu)
    );
    same!(
        list,
        "atmosphere::scatter",
        "air_tables",
        air_tables,
        step_share
    );
    other!(
        list,
        "atmosphere::scatter::scattered_radiance",
        "air_tables::scattered_radiance",
        |air: Air, scattered: Scattered, nu: f64| air_tables::scattered_radiance(
            air.0, scattered, nu
        )
    );
    same!(
        list,
        "atmosphere::sky_view",
        "air_tables",
        air_tables,
        sky_place,
        sky_place_inside,
        sky_place_outside,
        sky_texel,
        sky_coded,
        encode_dusk,
        decode_dusk,
        sky_direction,
        sky_rows,
        sky_row
    );
    same!(
        list,
        "atmosphere::aerial",
        "air_tables",
        air_tables,
        aerial_row,
        aerial_spacing,
        aerial_distance,
        aerial_slice
    );
    same!(list, "clouds::field", "clouds", clouds, shape_coverage);
    same!(
        list,
        "clouds::integral",
        "clouds",
        clouds,
        step_light,
        mean_density
    );
    same!(list, "clouds::harmonics", "clouds", clouds, harmonics);
    other!(
        list,
        "clouds::field::cloud_density",
        "clouds::cloud_density",
        |layer: CloudLayer, relative: [f64; 3], altitude: f64| clouds::cloud_density(
            &layer, relative, altitude
        )
    );
    other!(
        list,
        "clouds::field::uncut_density",
        "clouds::uncut_density",
        |layer: CloudLayer, relative: [f64; 3], altitude: f64| clouds::uncut_density(
            &layer, relative, altitude
        )
    );
    same!(list, "clouds::shape", "clouds", clouds, kind_profile);
    other!(
        list,
        "clouds::shape::billows",
        "clouds::billows",
        |turn: [u32; 3], bits: u32, seed: u32| clouds::billows(
            turn.map(|t| f64::from(t) * 0.5_f64.powi(32)),
            bits,
            seed
        )
    );
    other!(
        list,
        "clouds::shape::shaped_density",
        "clouds::shaped_density",
        |layer: CloudLayer, shape: CloudShape, relative: [f64; 3], altitude: f64| {
            clouds::shaped_density(&layer, &shape, relative, altitude)
        }
    );
    other!(
        list,
        "clouds::march::layer_exit",
        "clouds::layer_exit",
        |layer: CloudLayer, radius: f64, altitude: f64, mu: f64| clouds::layer_exit(
            &layer, radius, altitude, mu
        )
    );
    other!(
        list,
        "clouds::march::sun_depth",
        "clouds::sun_depth",
        |layer: CloudLayer,
         radius: f64,
         relative: [f64; 3],
         altitude: f64,
         to_sun: [f64; 3],
         mu: f64,
         steps: i32| {
            clouds::sun_depth(&layer, radius, relative, altitude, to_sun, mu, steps)
        }
    );
    other!(
        list,
        "clouds::march::march_clouds",
        "clouds::march_clouds",
        |layer: CloudLayer,
         radius: f64,
         eye: f64,
         dir: [f64; 3],
         to_sun: [f64; 3],
         far: f64,
         steps: i32,
         light: i32,
         jitter: f64| {
            clouds::march_clouds(&layer, radius, eye, dir, to_sun, far, steps, light, jitter)
        }
    );
    // What is left when the march ends early is within the error.
    other!(
        list,
        "clouds::march::march_clouds_skip",
        "clouds::march_clouds",
        |layer: CloudLayer,
         radius: f64,
         eye: f64,
         dir: [f64; 3],
         to_sun: [f64; 3],
         far: f64,
         steps: i32,
         light: i32,
         _least: f64,
         jitter: f64| clouds::march_clouds(
            &layer, radius, eye, dir, to_sun, far, steps, light, jitter
        )
    );
    other!(
        list,
        "clouds::composite::composite_clouds",
        "clouds::composite_clouds",
        clouds::composite_clouds
    );
    other!(
        list,
        "terrain::height::height",
        "terrain::height",
        |land: Terrain, offset: [f64; 2], octaves: i32| terrain::height(&land, offset, octaves)
    );
    other!(
        list,
        "terrain::field::ground_at",
        "field::ground",
        |field: Field, kind: i32, offset: [f64; 2], footprint: f64| {
            field::ground(&field, kind, offset, footprint)
        }
    );
    other!(
        list,
        "terrain::field::height_spread",
        "field::height_spread",
        field::height_spread
    );
    other!(
        list,
        "terrain::globe::globe_ground",
        "globe::ground",
        |ball: Globe, kind: i32, cell: [i32; 3], frac: [f64; 3], up: [f64; 3], footprint: f64| {
            globe::ground(&ball, kind, cell, frac, up, footprint)
        }
    );
    other!(
        list,
        "terrain::globe::globe_at",
        "globe::ground_from",
        |ball: Globe, kind: i32, at: [f64; 3], footprint: f64| {
            globe::ground_from(&ball, kind, at, footprint)
        }
    );
    other!(
        list,
        "terrain::material::faded_noise",
        "terrain::faded_noise",
        |rock: Rock, position: [f64; 3], fineness: [i32; 3], seed: u32, footprint: f64| {
            terrain::faded_noise(&rock, position, fineness, seed, footprint)
        }
    );
    other!(
        list,
        "terrain::material::rock_low_faded",
        "terrain::rock_low_faded",
        |rock: Rock, position: [f64; 3], footprint: f64| {
            terrain::rock_low_faded(&rock, position, footprint)
        }
    );
    other!(
        list,
        "terrain::material::rock_high_faded",
        "terrain::rock_high_faded",
        |rock: Rock, position: [f64; 3], footprint: f64| {
            terrain::rock_high_faded(&rock, position, footprint)
        }
    );
    other!(
        list,
        "terrain::march::ray_clearance",
        "terrain::ray_clearance",
        |land: Terrain, radius: f64, eye: f64, dir: [f64; 3], t: f64, octaves: i32| {
            terrain::ray_clearance(&land, radius, eye, dir, t, octaves)
        }
    );
    other!(
        list,
        "terrain::march::march_constant",
        "terrain::march_constant",
        |land: Terrain,
         radius: f64,
         eye: f64,
         dir: [f64; 3],
         near: f64,
         far: f64,
         step: f64,
         most: i32,
         octaves: i32,
         joined: bool| {
            terrain::march_constant(
                &land, radius, eye, dir, near, far, step, most, octaves, joined,
            )
        }
    );
    other!(
        list,
        "terrain::march::march",
        "terrain::march",
        |land: Terrain,
         radius: f64,
         eye: f64,
         dir: [f64; 3],
         near: f64,
         far: f64,
         factor: f64,
         epsilon: f64,
         most: i32,
         octaves: i32| {
            terrain::march(
                &land, radius, eye, dir, near, far, factor, epsilon, most, octaves,
            )
        }
    );
    other!(
        list,
        "terrain::normal::terrain_slope",
        "terrain::terrain_slope",
        |land: Terrain, offset: [f64; 2], step: f64, octaves: i32| terrain::terrain_slope(
            &land, offset, step, octaves
        )
    );
    other!(
        list,
        "terrain::normal::local_normal",
        "terrain::local_normal",
        |land: Terrain, offset: [f64; 2], step: f64, octaves: i32| terrain::local_normal(
            &land, offset, step, octaves
        )
    );
    other!(
        list,
        "terrain::normal::terrain_normal",
        "terrain::terrain_normal",
        |land: Terrain, radius: f64, eye: f64, relative: [f64; 3], step: f64, octaves: i32| {
            terrain::terrain_normal(&land, radius, eye, relative, step, octaves)
        }
    );
    let four = |f: &dyn Fn(usize) -> f64| -> [f64; 4] { std::array::from_fn(f) };
    other!(
        list,
        "ground::flow::level_drop",
        "ground::level_drop",
        move |a: [f64; 4], b: [f64; 4], water: [f64; 4]| {
            four(&|k| ground::level_drop(a[k], b[k], water[k]))
        }
    );
    other!(
        list,
        "ground::flow::driven_speed",
        "ground::driven_speed",
        move |v: [f64; 4], drop: [f64; 4], step: f64, damping: f64| {
            four(&|k| ground::driven_speed(v[k], drop[k], step, damping))
        }
    );
    other!(
        list,
        "ground::flow::outflow_share",
        "ground::outflow_share",
        move |water: [f64; 4], out: [f64; 4]| {
            four(&|k| ground::outflow_share(water[k], out[k]))
        }
    );
    other!(
        list,
        "ground::flow::mixed_speed",
        "ground::mixed_speed",
        move |v: [f64; 4], kept: [f64; 4], w: [f64; 4], more: [f64; 4]| {
            four(&|k| ground::mixed_speed(v[k], kept[k], w[k], more[k]))
        }
    );
    other!(
        list,
        "ground::shallow::sill_depth",
        "ground::sill_depth",
        move |depth: [f64; 4], rise: [f64; 4]| { four(&|k| ground::sill_depth(depth[k], rise[k])) }
    );
    other!(
        list,
        "ground::shallow::discharge",
        "ground::discharge",
        move |v: [f64; 4], near: [f64; 4], far: [f64; 4]| {
            four(&|k| ground::discharge(v[k], near[k], far[k]))
        }
    );
    other!(
        list,
        "ground::shallow::rubbed_speed",
        "ground::rubbed_speed",
        move |v: [f64; 4], depth: [f64; 4], friction: f64, gravity: f64, step: f64| {
            four(&|k| ground::rubbed_speed(v[k], depth[k], friction, gravity, step))
        }
    );
    other!(
        list,
        "ground::erosion::capacity",
        "ground::capacity",
        move |v: [f64; 4], depth: [f64; 4], strength: f64, deepest: f64| {
            four(&|k| ground::capacity(v[k], depth[k], strength, deepest))
        }
    );
    other!(
        list,
        "ground::erosion::dissolved",
        "ground::dissolved",
        move |load: [f64; 4],
              most: [f64; 4],
              soft: [f64; 4],
              depth: [f64; 4],
              dig: f64,
              lay: f64| {
            four(&|k| ground::dissolved(load[k], most[k], soft[k], depth[k], dig, lay))
        }
    );
    other!(
        list,
        "ground::erosion::slid",
        "ground::slid",
        move |a: [f64; 4], b: [f64; 4], steepest: f64, rate: f64| {
            four(&|k| ground::slid(a[k], b[k], steepest, rate))
        }
    );
    same!(
        list,
        "ground::shape",
        "ground",
        ground,
        bump,
        bed_share,
        smoothed_height
    );
    same!(
        list,
        "ground::surface",
        "ground",
        ground,
        displayed_level,
        fast_normal,
        counted_level
    );
    other!(
        list,
        "terrain::shadow::soft_shadow",
        "terrain::soft_shadow",
        |land: Terrain,
         radius: f64,
         eye: f64,
         relative: [f64; 3],
         normal: [f64; 3],
         to_sun: [f64; 3],
         bias: f64,
         far: f64,
         sharpness: f64,
         factor: f64,
         epsilon: f64,
         most: i32,
         octaves: i32| {
            // The samples taken are not the twin's.
            (
                terrain::soft_shadow(
                    &land, radius, eye, relative, normal, to_sun, bias, far, sharpness, factor,
                    epsilon, most, octaves,
                ),
                0,
            )
        }
    );
    same!(
        list,
        "terrain::shading",
        "terrain",
        terrain,
        bounce_direction
    );
    other!(
        list,
        "terrain::shading::shade_three_lights",
        "terrain::shade_three_lights",
        |lights: ThreeLights, normal: [f64; 3], to_sun: [f64; 3], shadow: f64| {
            terrain::shade_three_lights(&lights, normal, to_sun, shadow)
        }
    );
    other!(
        list,
        "terrain::shading::shade_rough",
        "terrain::shade_rough",
        |lights: ThreeLights, slope: [f64; 2], lost: f64, to_sun: [f64; 3], shadow: f64| {
            terrain::shade_rough(&lights, slope, lost, to_sun, shadow)
        }
    );
    other!(
        list,
        "terrain::material::rock_low",
        "terrain::rock_low",
        |rock: Rock, position: [f64; 3]| terrain::rock_low(&rock, position)
    );
    other!(
        list,
        "terrain::material::rock_high",
        "terrain::rock_high",
        |rock: Rock, position: [f64; 3]| terrain::rock_high(&rock, position)
    );
    other!(
        list,
        "terrain::material::rock_low_filtered",
        "terrain::rock_low_filtered",
        |rock: Rock, position: [f64; 3], dpdx: [f64; 3], dpdy: [f64; 3], samples: i32| {
            terrain::rock_low_filtered(&rock, position, dpdx, dpdy, samples)
        }
    );
    other!(
        list,
        "terrain::material::rock_high_filtered",
        "terrain::rock_high_filtered",
        |rock: Rock, position: [f64; 3], dpdx: [f64; 3], dpdy: [f64; 3], samples: i32| {
            terrain::rock_high_filtered(&rock, position, dpdx, dpdy, samples)
        }
    );
    same!(
        list,
        "terrain::material",
        "terrain",
        terrain,
        surface_footprint,
        snow_blend
    );
    list.into_iter().map(particular).map(measured).collect()
}

/// Weights of functions that measurement has shown to cost more, or less, than their kind: the time of an evaluation, on the device and in the twin, in units of 0.4
/// microseconds of a processor that runs the device in software.
const MEASURED: &[(&str, f64)] = &[
    ("atmosphere::aerial::aerial_spacing", 2.6),
    ("atmosphere::columns::column_scale", 3.5),
    ("atmosphere::diffuse::add_moments", 6.0),
    ("atmosphere::diffuse::decode_moments", 3.4),
    ("atmosphere::diffuse::diffuse_source", 13.0),
    ("atmosphere::diffuse::encode_moments", 2.2),
    ("atmosphere::diffuse::level_irradiance", 2.3),
    ("atmosphere::diffuse::plane_irradiance", 3.6),
    ("atmosphere::march::air_density", 2.7),
    ("atmosphere::march::march_sky", 45.0),
    ("atmosphere::medium::air_densities", 3.2),
    ("atmosphere::medium::air_extinction", 3.3),
    ("atmosphere::medium::air_phases", 2.9),
    ("atmosphere::medium::air_scattering", 4.7),
    ("atmosphere::medium::peak_phase", 2.2),
    ("atmosphere::orders::further_orders", 5.6),
    ("atmosphere::ray::air_ray", 4.0),
    ("atmosphere::ray::lowest_distance", 1.9),
    ("atmosphere::ray::ray_altitude", 2.2),
    ("atmosphere::ray::ray_inside", 3.4),
    ("atmosphere::ray::ray_sun_cosine", 2.3),
    ("atmosphere::scatter::scattered_radiance", 3.5),
    ("atmosphere::scatter::split_phases", 9.2),
    ("atmosphere::sky_view::sky_coded", 2.2),
    ("atmosphere::sky_view::sky_direction", 4.1),
    ("atmosphere::sky_view::sky_place", 4.6),
    ("atmosphere::sky_view::sky_place_inside", 3.6),
    ("atmosphere::sky_view::sky_place_outside", 4.8),
    ("atmosphere::sky_view::sky_row", 2.9),
    ("atmosphere::sky_view::sky_rows", 2.6),
    ("atmosphere::sky_view::sky_texel", 3.4),
    ("atmosphere::sun_disc::disc_in_pixel", 24.0),
    ("atmosphere::sun_disc::sun_disc", 4.2),
    ("atmosphere::textbook::march_sun_depth", 120.0),
    ("clouds::composite::composite_clouds", 3.0),
    ("clouds::field::cloud_density", 5.1),
    ("clouds::field::uncut_density", 5.1),
    ("clouds::march::march_clouds", 110.0),
    ("clouds::march::march_clouds_skip", 48.0),
    ("clouds::march::sun_depth", 51.0),
    ("fractal::fbm::fbm_2d", 5.5),
    ("fractal::fbm::fbm_value_3d", 7.4),
    ("fractal::fbm::fbm_value_3d_torus_six", 6.8),
    ("fractal::warp::warped_fbm_3d", 18.0),
    ("fractal::warp::warped_fbm_3d_slope", 19.0),
    ("fractal::warp::warped_slope_3d", 2.7),
    ("math::gauss::gauss_five", 4.0),
    ("math::gauss::gauss_four", 3.2),
    ("noise::lattice::octave_3d", 2.0),
    ("noise::lattice::split_3d", 1.9),
    ("noise::simplex::simplex_noise_2d", 5.8),
    ("noise::simplex::simplex_noise_2d_periodic", 7.1),
    ("noise::simplex::simplex_noise_2d_periodic_slope", 6.1),
    ("noise::simplex::simplex_noise_2d_slope", 6.5),
    ("noise::worley::worley_noise_2d", 2.9),
    ("noise::worley::worley_noise_2d_slope", 2.5),
    ("noise::worley::worley_second_2d_slope", 2.9),
    ("terrain::field::ground_at", 20.0),
    ("terrain::march::march", 120.0),
    ("terrain::material::rock_high_filtered", 110.0),
    ("terrain::material::rock_low_filtered", 36.0),
    ("terrain::material::surface_footprint", 2.0),
    ("terrain::shading::shade_rough", 2.0),
    ("terrain::shading::shade_three_lights", 2.1),
    ("terrain::shadow::soft_shadow", 42.0),
    ("tone_map::agx::agx", 2.4),
];

/// The entry with its measured weight.
fn measured(entry: Entry) -> Entry {
    let name = entry.path.strip_prefix("veduta::").unwrap_or(entry.path);
    match MEASURED.iter().find(|(path, _)| *path == name) {
        Some((_, weight)) => entry.weight(*weight),
        None => entry,
    }
}

/// The most that a march of `soft_shadow` and its kin samples here; the header's domain goes further.
const FEW_STEPS: f64 = 100.0;

/// What is particular about a function.
fn particular(entry: Entry) -> Entry {
    let Some((module, name)) = entry
        .path
        .strip_prefix("veduta::")
        .and_then(|p| p.rsplit_once("::"))
    else {
        return entry;
    };
    match (module, name) {
        ("noise::lattice", "split_2d" | "octave_2d") => {
            entry.judged(&["cell", "frac"]).align(same_place::<2>)
        }
        ("noise::lattice", "split_3d" | "octave_3d") => {
            entry.judged(&["cell", "frac"]).align(same_place::<3>)
        }
        ("noise::lattice", "turn_3d") => entry.align(same_turn),
        ("hash::lattice", "hash_source_2d") => {
            let mut entry = entry.branch("position", &[-3e6, 3e6, 0.0]);
            entry.prepare.push(Prepare::Whole("position"));
            entry
        }
        ("noise::simplex", _) => entry.weight(if name.contains("3d") { 6.0 } else { 3.0 }),
        ("noise::worley", _) if name.contains("slope") => entry
            .jumps("points as near as others, and the points themselves", 1e-5)
            .weight(if name.contains("3d") { 30.0 } else { 10.0 }),
        ("noise::worley", "worley_noise_2d" | "worley_noise_2d_periodic") => entry.weight(10.0),
        ("noise::worley", "worley_noise_3d" | "worley_noise_3d_periodic") => entry.weight(30.0),
        ("noise::value" | "noise::gradient", _) => {
            entry.weight(if name.contains("3d") { 3.0 } else { 2.0 })
        }
        ("fractal::ridged", "smooth_abs") => entry,
        ("fractal::ridged", "ridged_multifractal_2d_slope")
        | ("fractal::hybrid", "hybrid_multifractal_2d_slope") => entry
            .jumps("crests, and weights that are cut off", 1e-6)
            .weight(20.0),
        ("fractal::warp", "warped_slope_2d" | "warped_slope_3d") => entry,
        ("fractal::warp", _) => entry.weight(8.0),
        ("fractal::fbm" | "fractal::hybrid" | "fractal::ridged", _) => entry.weight(20.0),
        ("math::series", _) => entry.branch("x", &[0.5, 16.6, 88.7]),
        ("medium::transmittance", "step_integral") => entry.branch("distance", &[0.5, 5.0]),
        ("post::srgb", _) => entry
            .branch("linear", &[0.003_130_8])
            .branch("encoded", &[0.04045]),
        ("tone_map::agx", "agx_sigmoid") => entry.branch("x", &[20.0 / 33.0]),
        ("tone_map::neutral", _) => entry.branch("color", &[0.04, 0.08, 0.76, 0.8]),
        ("planet::shell", "sphere_span") => entry
            .branch("mu", &[-0.1, -0.01, -0.001, 1e-3, 0.01])
            .jumps("tangent rays, starts on the sphere", 1e-6),
        ("planet::shell", "top_distance") => entry.jumps("level rays from the top", 1e-6),
        ("planet::shell", "ground_distance") => entry.jumps("tangent rays", 1e-6),
        ("planet::shell", "shell_segment") => entry
            .branch("h", &[100.0, 5e3, 6e3, 2e4])
            .jumps("tangent rays, starts on a sphere", 1e-6)
            .weight(2.0),
        ("planet::shell", "clip_segment" | "segment_length" | "segment_distance") => entry
            .lin("segment.near", 0.0, 1e6)
            .lin("segment.gap_near", 0.0, 1e6)
            .lin("segment.gap_far", 0.0, 1e6)
            .lin("segment.far", 0.0, 1e6)
            .ascending(&[
                "segment.near",
                "segment.gap_near",
                "segment.gap_far",
                "segment.far",
            ])
            .jumps("the border of the gap", 1e-6),
        ("atmosphere::march", "air_density") => entry.air(),
        ("atmosphere::march", "air_column") => entry.air().lin("steps", 1.0, 64.0).weight(20.0),
        ("atmosphere::march", "sun_transmittance") => entry
            .air()
            .lin("steps", 1.0, 64.0)
            .jumps("rays along the ground", 1e-6)
            .weight(20.0),
        ("atmosphere::march", "march_sky") => entry
            .air()
            .unit("dir")
            .unit("to_sun")
            .lin("steps", 1.0, 32.0)
            .lin("light_steps", 1.0, 16.0)
            .jumps(
                "samples at the border of the planet's shadow, rays along the ground",
                1e-6,
            )
            .energy(sky_energy)
            .weight(300.0),
        ("atmosphere::ray", "zenith_parts") => entry.unit("dir"),
        ("atmosphere::ray", "tangent_altitude") => entry
            .unit("dir")
            .log("h", 1.0, 1e8)
            .branch("h", &[1e5, 3.6e7]),
        ("atmosphere::ray", "ray_inside") => entry
            .unit("dir")
            .unit("to_sun")
            .judged(&["mu", "sine", "nu", "sun_mu"]),
        ("atmosphere::ray", "air_ray") => entry
            .unit("dir")
            .unit("to_sun")
            .log("eye_altitude", 1.0, 1e8)
            .judged(&["mu", "sine", "nu", "sun_mu"])
            .jumps("rays that graze the top of the air", 1e-6),
        ("atmosphere::ray", "ray_altitude" | "ray_sun_cosine" | "lowest_distance") => entry.ray(),
        ("atmosphere::textbook", "march_sun_depth") => entry.lin("steps", 1.0, 32.0).weight(30.0),
        ("atmosphere::textbook", "march_air") => entry
            .ray()
            .lin("ray.nu", -1.0, 0.9)
            .lin("steps", 1.0, 16.0)
            .lin("light_steps", 1.0, 8.0)
            .ascending(&["ray.dark_from", "ray.dark_to"])
            .jumps("the border of the planet's shadow", 1e-6)
            .weight(600.0),
        ("atmosphere::medium", _) => entry
            .branch("nu", &[0.999, 0.9999])
            .branch("h", &[1e3, 2e3, 3e3, 4e3, 5e3, 1e4, 1.2e4, 2.5e4, 3e4, 4e4]),
        ("atmosphere::columns", "column_coordinates") => {
            let level = |radius| air_tables::horizon_cosine(radius, 5e4);
            entry
                .lin("h", 0.0, 5e4)
                .branch("mu", &[level(3e6), level(1e8)])
        }
        ("atmosphere::columns", "column_scale")
        | ("atmosphere::transmittance", "transmittance_coordinates") => entry.lin("h", 0.0, 5e4),
        ("atmosphere::columns", "path_to_top") => entry
            .lin("h", 0.0, 5e4)
            .branch("mu", &[-0.1, -0.01, -1e-3, 1e-3, 0.01]),
        ("atmosphere::columns", "columns_to_top" | "column_code")
        | ("atmosphere::transmittance", "transmittance_code") => entry
            .lin("h", 0.0, 5e4)
            .branch("h", &[100.0, 1e3, 1e4])
            .branch("mu", &[-0.1, -0.01, -1e-3, 1e-3, 0.01])
            .jumps("level rays from the top", 1e-6)
            .weight(30.0),
        ("atmosphere::columns", "sun_above_horizon") => entry
            .branch("mu", &[-0.1, -0.01, -1e-3])
            .jumps("a small sun at the horizon", 1e-6),
        ("atmosphere::diffuse", "diffuse_source") => entry.weight(3.0),
        ("atmosphere::diffuse", "plane_irradiance") => entry.unit("normal").unit("to_sun"),
        ("atmosphere::scatter", "split_phases") => entry.branch("nu", &[0.999, 0.9999]),
        ("atmosphere::scatter", "step_share") => entry.branch("depth", &[f64::from(0.1_f32), 0.01]),
        // How long a ray is near the horizon no f32 says; a test compares it with rays.
        ("atmosphere::sky_view", "sky_place" | "sky_place_inside" | "sky_place_outside") => {
            let entry = entry
                .eye()
                .lin("eye.top", 5e4, 1e5)
                .unit("dir")
                .judged(&["x", "y", "below", "nu"])
                .jumps(
                    "directions along the horizon, and those without an azimuth",
                    1e-6,
                );
            match name {
                "sky_place_inside" => entry.lin("eye.altitude", 0.0, 5e4),
                "sky_place_outside" => entry.log("eye.altitude", 1.1e5, 1e8),
                _ => entry,
            }
        }
        ("atmosphere::sky_view", "sky_texel") => entry.unit("look.to_sun").unit("ray").jumps(
            "directions along the horizon, and those without an azimuth",
            1e-6,
        ),
        ("atmosphere::sky_view", "encode_dusk" | "decode_dusk") => entry,
        ("atmosphere::sky_view", "sky_coded") => {
            entry.eye().jumps("the altitude of the change", 1e-6)
        }
        ("atmosphere::sky_view", "sky_direction") => entry.eye().jumps("a sun in the zenith", 1e-6),
        ("atmosphere::sky_view", _) => {
            let mut entry = entry.eye();
            entry.prepare.push(Prepare::Whole("rows"));
            entry
        }
        ("atmosphere::aerial", "aerial_row") => {
            let mut entry = entry;
            entry.prepare.push(Prepare::Whole("rows"));
            entry
        }
        ("atmosphere::aerial", "aerial_spacing") => {
            entry.eye().jumps("the altitude of the change", 1e-6)
        }
        ("atmosphere::sun_disc", "sun_disc") => entry.unit("dir").unit("to_sun"),
        ("clouds::field", "cloud_density") => entry
            .layer()
            .branch("altitude", &[4000.0, 5500.0])
            .jumps("the layer's borders", 1e-6)
            .weight(20.0),
        ("clouds::field", "uncut_density") => entry.layer().weight(20.0),
        ("clouds::shape", "shaped_density") => entry
            .layer()
            .lin("shape.kind", 0.0, 1.0)
            .lin("shape.kind_spread", 0.0, 1.0)
            .lin("shape.coverage_spread", 0.0, 2.0)
            .lin("shape.detail", 0.0, 1.0)
            .lin("shape.sharpness", 1.0, 8.0)
            .lin("shape.weather_doublings", 1.0, 4.0)
            .weight(20.0),
        ("clouds::march", "layer_exit") => entry.layer().jumps("tangent rays", 1e-6).weight(2.0),
        ("clouds::march", "sun_depth") => entry
            .layer()
            .unit("to_sun")
            .lin("steps", 1.0, 16.0)
            .jumps("tangent rays", 1e-6)
            .weight(200.0),
        ("clouds::march", _) => {
            let judged: &[&str] = &["scatter", "transmittance"];
            let entry = entry
                .layer()
                .unit("dir")
                .unit("to_sun")
                .lin("steps", 1.0, 32.0)
                .lin("light_steps", 1.0, 8.0)
                // A sample on the layer's border is inside or outside by its rounding.
                .lin("jitter", 0.01, 0.99)
                .judged(judged)
                .jumps(
                    "tangent rays, samples at the border of the planet's shadow",
                    1e-6,
                )
                .energy(cloud_energy)
                .weight(3000.0);
            if name == "march_clouds_skip" {
                entry.lin("min_transmittance", 0.0, 1e-4)
            } else {
                entry
            }
        }
        ("clouds::composite", _) => entry
            .lin("clouds.scatter", 0.0, 100.0)
            .lin("clouds.transmittance", 0.0, 1.0)
            .lin("clouds.mean_distance", 0.0, 1e6)
            .lin("clouds.density_samples", 0.0, 512.0)
            .lin("clouds.light_samples", 0.0, 32768.0)
            .lin("front.in_scatter", 0.0, 10.0)
            .lin("front.transmittance", 0.0, 1.0),
        ("terrain::height", _) => entry.terrain().weight(20.0),
        ("terrain::field", _) => entry.field().judged(&["height"]).weight(60.0),
        ("terrain::globe", "globe_ground") => {
            entry.globe().unit("up").judged(&["height"]).weight(100.0)
        }
        ("terrain::globe", _) => entry.globe().judged(&["height"]).weight(100.0),
        ("terrain::refine", _) => entry
            .field()
            .unit("dir")
            .lin("steps", 1.0, 1.0)
            .judged(&["ground.height"])
            .weight(60.0),
        ("terrain::march", "ray_clearance") => entry.terrain().unit("dir").weight(20.0),
        ("terrain::march", "march_constant") => entry
            .terrain()
            .lin("eye_altitude", 0.0, 4000.0)
            .unit("dir")
            .lin("max_steps", 0.0, FEW_STEPS)
            .judged(&["distance"])
            .jumps("grazing rays, the last step", 3e-5)
            .weight(500.0),
        ("terrain::march", "march") => entry
            .terrain()
            .lin("eye_altitude", 0.0, 4000.0)
            .unit("dir")
            .lin("max_steps", 0.0, FEW_STEPS)
            .judged(&["distance"])
            .jumps("grazing rays, the last step", 3e-5)
            .weight(500.0),
        ("terrain::normal", "terrain_normal" | "local_normal" | "terrain_slope") => {
            entry.terrain().weight(60.0)
        }
        ("terrain::shadow", _) => entry
            .terrain()
            .lin("eye_altitude", 0.0, 4000.0)
            .lin("relative", -3000.0, 3000.0)
            .unit("normal")
            .unit("to_sun")
            .lin("max_steps", 0.0, FEW_STEPS)
            .judged(&["light"])
            .jumps("grazing rays, the last step", 3e-5)
            .weight(500.0),
        ("terrain::shading", "bounce_direction") => entry.unit("to_sun").branch("to_sun", &[1e-5]),
        ("terrain::shading", _) => entry.unit("normal").unit("to_sun"),
        ("terrain::material", "faded_noise") => entry.rock().weight(10.0),
        ("terrain::material", "rock_low_faded") => entry.rock().weight(20.0),
        ("terrain::material", "rock_high_faded") => entry.rock().weight(80.0),
        ("terrain::material", "rock_low") => entry.rock().weight(10.0),
        ("terrain::material", "rock_high") => entry.rock().weight(40.0),
        ("terrain::material", "rock_low_filtered") => {
            entry.rock().lin("samples", 1.0, 4.0).weight(100.0)
        }
        ("terrain::material", "rock_high_filtered") => {
            entry.rock().lin("samples", 1.0, 4.0).weight(400.0)
        }
        ("terrain::material", "surface_footprint") => entry.unit("dir").unit("normal"),
        ("terrain::material", "snow_blend") => entry.branch("normal_y", &[0.0, 1.0]),
        _ => entry,
    }
}
