//! `veduta probe`: the light along given rays, of the sky and of clouds, and heights of given places.

use std::path::{Path, PathBuf};

use veduta::Atmosphere;
use veduta::atmosphere::{Orders, ProbeOptions, ProbePath, ProbeRay, SkyQuality, probe};
use veduta::clouds::{
    AirLights, CloudDeck, CubeOptions, CubeRay, DensityCube, LayerOptions, cube_light, layer_light,
};
use veduta::eval::ResultKind;
use veduta::reference;
use veduta::terrain::{Land, RayPath, TerrainRay, ray_hits};
use veduta::{Preset, Settings, WorldPos};

use crate::error::CliError;
use crate::image::check_folder;
use crate::table::{Format, Table, read_cube, write_results};

/// Arguments of `veduta probe`.
#[derive(Debug, Clone, clap::Args)]
pub struct ProbeArgs {
    /// What to probe.
    #[command(subcommand)]
    pub what: What,
}

/// What can be probed.
#[derive(Debug, Clone, clap::Subcommand)]
pub enum What {
    /// Radiance and transmittance of the sky along rays
    Sky(SkyArgs),
    /// Heights of a land at given places
    Height(HeightArgs),
    /// Where rays meet a land
    Terrain(TerrainArgs),
    /// Radiance and transmittance of clouds alone along rays
    Clouds(CloudsArgs),
}

/// Arguments of `veduta probe clouds`.
#[derive(Debug, Clone, clap::Args)]
pub struct CloudsArgs {
    /// A cube of densities, .npy: float32 in the order z, y, x
    #[arg(
        long,
        value_name = "DENSITY",
        conflicts_with = "scene",
        required_unless_present = "scene"
    )]
    pub volume: Option<PathBuf>,
    /// A shipped layer or a .ron file; its rows are those of `probe sky`
    #[arg(long, value_name = "NAME|FILE")]
    pub scene: Option<String>,
    /// Extinction per unit of density, 1/m [default: 1; a layer's own]
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub extinction: Option<f64>,
    /// Scattered share of the extinction [default: 1; a layer's own]
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    pub albedo: Option<f64>,
    /// Asymmetry of the phase function, one lobe of Henyey and Greenstein [default: 0.85; a layer's own two lobes]
    #[arg(long, value_name = "G", allow_hyphen_values = true)]
    pub g: Option<f64>,
    /// Edge of the cube in metres [default: 1000]
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    pub size: Option<f64>,
    /// A layer under an air: the sun behind it, and for all orders the sky's light and the ground's. The clouds alone are shown, without the air before them
    #[arg(long)]
    pub lit: bool,
    /// The air of --lit: a shipped atmosphere or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "earth")]
    pub atmosphere: String,
    /// The rays, .npy or .csv: origin and direction in cube coordinates, direction to the sun
    #[arg(long, value_name = "ROWS")]
    pub rays: PathBuf,
    /// How the light is found
    #[arg(long, value_enum, default_value = "reference")]
    pub path: How,
    /// Which light is counted: scattered once, or any number of times
    #[arg(long, value_enum, default_value = "all")]
    pub orders: Which,
    /// No sun, but a radiance of 1 from all around, which is not counted where the cloud lets it through
    #[arg(long)]
    pub furnace: bool,
    /// Random paths a ray of the reference, 2 to 1e9
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1_000_000_000), default_value = "4096")]
    pub samples: u32,
    /// Seed of the random paths
    #[arg(long, value_name = "S", default_value = "1")]
    pub seed: u64,
    /// Where radiance and transmittance go, .npy or .csv
    #[arg(long, value_name = "LIGHT")]
    pub out: PathBuf,
    /// Where the standard errors of the reference's radiance go, .npy or .csv
    #[arg(long, value_name = "ERRORS")]
    pub errors: Option<PathBuf>,
}

/// How rays are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Follow {
    /// In double precision on the processor, by bracketing
    Reference,
    /// On the device, by steps in proportion to the clearance
    Textbook,
    /// On the device, over baked heights
    Fast,
}

/// Arguments of `veduta probe terrain`.
#[derive(Debug, Clone, clap::Args)]
pub struct TerrainArgs {
    /// A shipped land or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "thesis")]
    pub scene: String,
    /// The rays, .npy or .csv: origin, unit direction, largest distance; over a ball along the world's axes, its centre being (0, -radius, 0)
    #[arg(long, value_name = "ROWS")]
    pub rays: PathBuf,
    /// How rays are followed
    #[arg(long, value_enum, default_value = "fast")]
    pub path: Follow,
    /// Angle of a pixel in radians, in [1e-5, 0.1]: the footprint is the distance times this
    #[arg(long, value_name = "RAD", default_value = "0.004")]
    pub pixel_angle: f32,
    /// Where the hits go, .npy or .csv: distance, normal, height
    #[arg(long, value_name = "HITS")]
    pub out: PathBuf,
}

/// Where the heights are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum On {
    /// On the processor, in the device's single precision
    Cpu,
    /// On the device
    Device,
    /// On the processor in double precision
    Reference,
}

/// Arguments of `veduta probe height`.
#[derive(Debug, Clone, clap::Args)]
pub struct HeightArgs {
    /// A shipped land or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "thesis")]
    pub scene: String,
    /// The places, .npy or .csv: x and z in metres; over a ball latitude and longitude in degrees
    #[arg(long, value_name = "XZ")]
    pub points: PathBuf,
    /// Where the heights are computed
    #[arg(long, value_enum, default_value = "cpu")]
    pub on: On,
    /// Width of what one height stands for, in metres; 0: the field as it is
    #[arg(
        long,
        value_name = "M",
        default_value = "0",
        allow_hyphen_values = true
    )]
    pub footprint: f32,
    /// Where the heights go, .npy or .csv
    #[arg(long, value_name = "H")]
    pub out: PathBuf,
}

/// How the light is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum How {
    /// In double precision on the processor: quadrature, and Monte Carlo for what is scattered more than once
    Reference,
    /// On the device, by marching
    Textbook,
    /// On the device, by tables
    Fast,
}

/// Which light is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Which {
    /// Scattered once by the air
    Single,
    /// Scattered any number of times, and reflected by the ground before
    All,
}

/// Arguments of `veduta probe sky`.
#[derive(Debug, Clone, clap::Args)]
pub struct SkyArgs {
    /// A shipped atmosphere or a .ron file
    #[arg(long, value_name = "NAME|FILE", default_value = "earth")]
    pub atmosphere: String,
    /// Albedo of the ground in all channels; the atmosphere's own when left out
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    pub albedo: Option<f64>,
    /// The rays, .npy or .csv: altitude, direction, direction to the sun, distance
    #[arg(long, value_name = "ROWS")]
    pub rays: PathBuf,
    /// How the light is found
    #[arg(long, value_enum, default_value = "reference")]
    pub path: How,
    /// Which light is counted
    #[arg(long, value_enum, default_value = "all")]
    pub orders: Which,
    /// The preset whose tables the path `fast` uses
    #[arg(long, value_name = "NAME", default_value = "high")]
    pub preset: String,
    /// Random paths a ray and channel of the reference, 2 to 1e9
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1_000_000_000), default_value = "4096")]
    pub samples: u32,
    /// Seed of the random paths
    #[arg(long, value_name = "S", default_value = "1")]
    pub seed: u64,
    /// Where radiance and transmittance go, .npy or .csv
    #[arg(long, value_name = "LIGHT")]
    pub out: PathBuf,
    /// Where the standard errors of the reference's radiance go, .npy or .csv
    #[arg(long, value_name = "ERRORS")]
    pub errors: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// [`CliError`] for names, files and rows that do not fit, with the row and what it must be; what the library reports.
pub fn run(args: &ProbeArgs) -> Result<(), CliError> {
    match &args.what {
        What::Sky(args) => sky(args),
        What::Height(args) => height(args),
        What::Terrain(args) => terrain(args),
        What::Clouds(args) => clouds(args),
    }
}

fn clouds(args: &CloudsArgs) -> Result<(), CliError> {
    for path in [Some(&args.out), args.errors.as_ref()]
        .into_iter()
        .flatten()
    {
        Format::of(path)?;
        check_folder(path)?;
    }
    if args.errors.is_some() && args.path != How::Reference {
        return Err(CliError::argument(
            "--errors",
            "given",
            "left out for paths other than `reference`, which alone knows its errors",
        ));
    }
    if args.furnace && args.orders == Which::Single {
        return Err(CliError::argument(
            "--furnace",
            "given",
            "left out for single scattering",
        ));
    }
    let Some(volume) = &args.volume else {
        return layer(args);
    };
    if args.lit {
        return Err(CliError::argument(
            "--lit",
            "given",
            "left out for a cube, which is in vacuum",
        ));
    }
    let (shape, density) = read_cube(volume)?;
    let cube = DensityCube {
        values: [shape[2], shape[1], shape[0]],
        density,
        size: args.size.unwrap_or(1000.0),
        extinction: args.extinction.unwrap_or(1.0),
        albedo: args.albedo.unwrap_or(1.0),
        g: args.g.unwrap_or(0.85),
    };
    cube.check()?;
    let numbers = Table::read(&args.rays, 9)?.to_numbers(&args.rays)?;
    let rays = numbers
        .as_chunks::<9>()
        .0
        .iter()
        .enumerate()
        .map(|(row, numbers)| CubeRay::from_row(row, *numbers))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| CliError::Table {
            path: args.rays.clone(),
            what: e.to_string(),
        })?;
    let (sun, uniform) = if args.furnace { (0.0, 1.0) } else { (1.0, 0.0) };
    let orders = match args.orders {
        Which::Single => Orders::Single,
        Which::All => Orders::All,
    };
    let mut light: Vec<u32> = Vec::with_capacity(6 * rays.len());
    let mut add = |scatter: f32, transmittance: f32| {
        light.extend([scatter; 3].map(f32::to_bits));
        light.extend([transmittance; 3].map(f32::to_bits));
    };
    let path = match args.path {
        How::Textbook => ProbePath::Textbook,
        How::Fast => ProbePath::Fast,
        How::Reference => {
            let effort = reference::volume::VolumePaths {
                samples: args.samples as usize,
                seed: args.seed,
                sun,
                uniform,
                ..Default::default()
            };
            let found = reference::volume::cube_light(&cube, &rays, orders, &effort);
            for f in &found {
                add(f[0] as f32, f[2] as f32);
            }
            if let Some(path) = &args.errors {
                let errors: Vec<u32> = found
                    .iter()
                    .flat_map(|f| [(f[1] as f32).to_bits(); 3])
                    .collect();
                write_results(path, &errors, 3, ResultKind::F32)?;
            }
            return write_results(&args.out, &light, 6, ResultKind::F32);
        }
    };
    let options = CubeOptions {
        path,
        orders,
        sun: sun as f32,
        uniform: uniform as f32,
    };
    let gpu = veduta::device::shared()?;
    for found in cube_light(gpu, veduta::programs(), &cube, &rays, &options)? {
        add(found.scatter, found.transmittance);
    }
    write_results(&args.out, &light, 6, ResultKind::F32)
}

/// What is shipped under a name, or what a `.ron` file says.
fn named_or_file<T>(
    name: &str,
    named: impl Fn(&str) -> Result<T, veduta::Error>,
    from_ron: impl Fn(&str) -> Result<T, veduta::Error>,
) -> Result<T, CliError> {
    let path = Path::new(name);
    if path.extension().is_none_or(|e| e != "ron") {
        return Ok(named(name)?);
    }
    let text = std::fs::read_to_string(path).map_err(|e| CliError::read(path, e))?;
    from_ron(&text).map_err(|e| CliError::Table {
        path: path.to_owned(),
        what: e.to_string(),
    })
}

/// A shipped layer of clouds by its name, or that of a `.ron` file.
///
/// # Errors
/// [`CliError::Read`], [`CliError::Table`] with the file and what is wrong in it, a name that does not exist.
pub fn deck(name: &str) -> Result<CloudDeck, CliError> {
    let path = Path::new(name);
    if path.extension().is_none_or(|e| e != "ron") {
        return Ok(CloudDeck::named(name)?);
    }
    std::fs::metadata(path).map_err(|e| CliError::read(path, e))?;
    CloudDeck::read(path).map_err(|e| CliError::Table {
        path: path.to_owned(),
        what: e.to_string(),
    })
}

fn layer(args: &CloudsArgs) -> Result<(), CliError> {
    let refused = |name: &str, given: bool, domain: &str| {
        if given {
            return Err(CliError::argument(name, "given", domain));
        }
        Ok(())
    };
    let device = args.path != How::Reference;
    refused(
        "--furnace",
        args.furnace && !device,
        "left out for the reference of a layer, below which there is dark ground",
    )?;
    refused(
        "--furnace",
        args.furnace && args.lit,
        "left out beside --lit",
    )?;
    refused(
        "--lit",
        args.lit && !device,
        "left out for the reference, which knows no air",
    )?;
    refused("--size", args.size.is_some(), "left out for a layer")?;
    let mut deck = deck(args.scene.as_deref().unwrap_or("thesis"))?;
    deck.extinction = args.extinction.unwrap_or(deck.extinction);
    deck.albedo = args.albedo.unwrap_or(deck.albedo);
    if let Some(g) = args.g {
        (deck.g_forward, deck.g_backward) = (g.max(0.0), g.min(0.0));
        deck.backward_share = if g < 0.0 { 1.0 } else { 0.0 };
    }
    deck.check()?;
    let numbers = Table::read(&args.rays, 8)?.to_numbers(&args.rays)?;
    let rays = numbers
        .as_chunks::<8>()
        .0
        .iter()
        .enumerate()
        .map(|(row, numbers)| ProbeRay::from_row(row, *numbers))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| CliError::Table {
            path: args.rays.clone(),
            what: e.to_string(),
        })?;
    let orders = match args.orders {
        Which::Single => Orders::Single,
        Which::All => Orders::All,
    };
    let mut light: Vec<u32> = Vec::with_capacity(6 * rays.len());
    let mut errors: Vec<u32> = Vec::new();
    let mut add = |scatter: f32, transmittance: f32| {
        light.extend([scatter; 3].map(f32::to_bits));
        light.extend([transmittance; 3].map(f32::to_bits));
    };
    if args.path == How::Reference {
        let paths = reference::volume::VolumePaths {
            samples: args.samples as usize,
            seed: args.seed,
            ..Default::default()
        };
        for f in reference::volume::layer_light(&deck, &rays, orders, &paths) {
            add(f[0] as f32, f[2] as f32);
            errors.extend([(f[1] as f32).to_bits(); 3]);
        }
        if let Some(path) = &args.errors {
            write_results(path, &errors, 3, ResultKind::F32)?;
        }
        return write_results(&args.out, &light, 6, ResultKind::F32);
    }
    let path = if args.path == How::Fast {
        ProbePath::Fast
    } else {
        ProbePath::Textbook
    };
    let gpu = veduta::device::shared()?;
    let found = |sun: f32, around: [f32; 2]| {
        let options = LayerOptions {
            path,
            orders,
            sun,
            around,
        };
        layer_light(gpu, veduta::programs(), &deck, &rays, &options)
    };
    if args.furnace {
        for found in found(0.0, [1.0; 2])? {
            add(found.scatter, found.transmittance);
        }
    } else if args.lit {
        let from_sun = found(1.0, [0.0; 2])?;
        // Light adds up: that from above and below is found for a radiance of 1.
        let around = if orders == Orders::All {
            Some([found(0.0, [1.0, 0.0])?, found(0.0, [0.0, 1.0])?])
        } else {
            None
        };
        let air = atmosphere(&args.atmosphere)?;
        let mut suns: Vec<([f64; 3], AirLights)> = Vec::new();
        for (i, ray) in rays.iter().enumerate() {
            let lights = match suns.iter().find(|(sun, _)| *sun == ray.to_sun) {
                Some((_, lights)) => *lights,
                None => {
                    let lights = AirLights::find(gpu, &air, &deck, ray.to_sun)?;
                    suns.push((ray.to_sun, lights));
                    lights
                }
            };
            let mut scatter = from_sun[i].scatter * lights.sun;
            if let Some([above, below]) = &around {
                scatter += above[i].scatter * lights.above + below[i].scatter * lights.below;
            }
            light.extend(scatter.to_array().map(f32::to_bits));
            light.extend([from_sun[i].transmittance; 3].map(f32::to_bits));
        }
    } else {
        for found in found(1.0, [0.0; 2])? {
            add(found.scatter, found.transmittance);
        }
    }
    write_results(&args.out, &light, 6, ResultKind::F32)
}

/// A shipped land by its name, or that of a `.ron` file.
///
/// # Errors
/// [`CliError::Read`], [`CliError::Table`] with the file and what is wrong in it, a name that does not exist, a land of a program's own function.
pub fn land(name: &str) -> Result<Land, CliError> {
    let mut land = named_or_file(name, Land::named, Land::from_ron)?;
    if let Some(map) = &mut land.field.map {
        map.read(Path::new(name).parent().unwrap_or(Path::new("")))?;
    }
    if let veduta::terrain::Kind::Own { .. } = land.field.kind {
        return Err(CliError::argument(
            "the land's field.kind",
            "Own".to_owned(),
            "a kind that the shipped programs have: a program's own function is plugged in when it is built",
        ));
    }
    Ok(land)
}

fn terrain(args: &TerrainArgs) -> Result<(), CliError> {
    Format::of(&args.out)?;
    check_folder(&args.out)?;
    let land = land(&args.scene)?;
    if !(1e-5..=0.1).contains(&args.pixel_angle) {
        return Err(CliError::argument(
            "--pixel-angle",
            args.pixel_angle.to_string(),
            "in [1e-5, 0.1] rad",
        ));
    }
    let fault = |what: String| CliError::Table {
        path: args.rays.clone(),
        what,
    };
    let numbers = Table::read(&args.rays, 7)?.to_numbers(&args.rays)?;
    let mut rays = Vec::with_capacity(numbers.len() / 7);
    for (row, [x, y, z, dx, dy, dz, far]) in numbers.as_chunks::<7>().0.iter().enumerate() {
        let near = x.abs() <= 9e15 && z.abs() <= 9e15 && y.abs() <= 1e5;
        let in_orbit = [x, y, z].iter().all(|c| c.abs() <= 1e9);
        if !(if land.field.on_sphere() {
            in_orbit
        } else {
            near
        }) {
            let domain = if land.field.on_sphere() {
                "within 1e9 m of the place at the altitude 0 on the y axis"
            } else {
                "within 9e15 m, and its altitude within 1e5 m"
            };
            return Err(fault(format!(
                "the origin of row {row} is ({x}, {y}, {z}), but must be {domain}"
            )));
        }
        let length = (dx * dx + dy * dy + dz * dz).sqrt();
        if length.is_nan() || (length - 1.0).abs() > 1e-3 {
            return Err(fault(format!(
                "the length of the direction of row {row} is {length}, but must be 1 to 1e-3"
            )));
        }
        let ray = TerrainRay {
            origin: WorldPos::from_metres([*x, *y, *z].into()),
            dir: [dx / length, dy / length, dz / length],
            far: *far,
        };
        ray.check(row).map_err(|e| fault(e.to_string()))?;
        rays.push(ray);
    }
    let hits = match args.path {
        Follow::Reference if land.field.on_sphere() => {
            let globe = land.globe::<f64>()?;
            let angle = f64::from(args.pixel_angle);
            rays.iter()
                .map(|r| globe.ray_hit(r, angle, 0.05))
                .collect::<Result<Vec<_>, _>>()?
        }
        Follow::Reference => {
            let field = land.prepare::<f64>()?;
            let angle = f64::from(args.pixel_angle);
            rays.iter()
                .map(|r| field.ray_hit(land.planet_radius, r, angle, 0.05))
                .collect::<Result<Vec<_>, _>>()?
        }
        path => {
            let path = if path == Follow::Fast {
                RayPath::Fast
            } else {
                RayPath::Textbook
            };
            let gpu = veduta::device::shared()?;
            ray_hits(
                gpu,
                veduta::programs(),
                &land,
                &rays,
                args.pixel_angle,
                path,
            )?
        }
    };
    let capped = hits.iter().filter(|h| h.capped).count();
    if capped > 0 {
        eprintln!("{capped} of {} rays ran out of steps", hits.len());
    }
    let found: Vec<u32> = hits
        .iter()
        .flat_map(|h| {
            let [x, y, z] = h.normal;
            [h.distance, x, y, z, h.height].map(|v| (v as f32).to_bits())
        })
        .collect();
    write_results(&args.out, &found, 5, ResultKind::F32)
}

fn height(args: &HeightArgs) -> Result<(), CliError> {
    Format::of(&args.out)?;
    check_folder(&args.out)?;
    let land = land(&args.scene)?;
    if !(args.footprint >= 0.0 && args.footprint.is_finite()) {
        return Err(CliError::argument(
            "--footprint",
            args.footprint.to_string(),
            "finite and at least 0 m",
        ));
    }
    if land.field.on_sphere() {
        return ball_height(args, &land);
    }
    let numbers = Table::read(&args.points, 2)?.to_numbers(&args.points)?;
    let mut places = Vec::with_capacity(numbers.len() / 2);
    for (row, [x, z]) in numbers.as_chunks::<2>().0.iter().enumerate() {
        let near = x.abs() <= 9e15 && z.abs() <= 9e15;
        if !near {
            return Err(CliError::Table {
                path: args.points.clone(),
                what: format!("row {row} is ({x}, {z}), but must be within 9e15 m"),
            });
        }
        places.push(WorldPos::from_metres([*x, 0.0, *z].into()));
    }
    let heights: Vec<u32> = match args.on {
        On::Device => {
            let gpu = veduta::device::shared()?;
            veduta::terrain::TerrainQuery::new(gpu, veduta::programs(), &land)?
                .heights(&places, args.footprint)?
                .iter()
                .map(|g| g.height.to_bits())
                .collect()
        }
        On::Cpu => {
            let field = land.prepare::<f32>()?;
            places
                .iter()
                .map(|p| field.ground(*p, args.footprint).height.to_bits())
                .collect()
        }
        On::Reference => {
            let field = land.prepare::<f64>()?;
            let footprint = f64::from(args.footprint);
            places
                .iter()
                .map(|p| (field.ground(*p, footprint).height as f32).to_bits())
                .collect()
        }
    };
    write_results(&args.out, &heights, 1, ResultKind::F32)
}

/// Heights of a ball: rows are latitude and longitude in degrees.
fn ball_height(args: &HeightArgs, land: &Land) -> Result<(), CliError> {
    let globe = land.globe::<f64>()?;
    let numbers = Table::read(&args.points, 2)?.to_numbers(&args.points)?;
    let mut places = Vec::with_capacity(numbers.len() / 2);
    for (row, [latitude, longitude]) in numbers.as_chunks::<2>().0.iter().enumerate() {
        if !(latitude.abs() <= 90.0 && longitude.abs() <= 360.0) {
            return Err(CliError::Table {
                path: args.points.clone(),
                what: format!(
                    "row {row} is ({latitude}, {longitude}), but must be a latitude in [-90, 90] and a longitude in [-360, 360] degrees"
                ),
            });
        }
        places.push(globe.above([latitude.to_radians(), longitude.to_radians()], 0.0));
    }
    let heights: Vec<u32> = match args.on {
        On::Device => {
            let gpu = veduta::device::shared()?;
            let programs = veduta::programs();
            veduta::terrain::globe_heights(gpu, programs, land, &places, args.footprint)?
                .iter()
                .map(|g| g.height.to_bits())
                .collect()
        }
        On::Cpu => {
            let globe = land.globe::<f32>()?;
            places
                .iter()
                .map(|p| globe.ground(*p, args.footprint).height.to_bits())
                .collect()
        }
        On::Reference => {
            let footprint = f64::from(args.footprint);
            places
                .iter()
                .map(|p| (globe.ground(*p, footprint).height as f32).to_bits())
                .collect()
        }
    };
    write_results(&args.out, &heights, 1, ResultKind::F32)
}

/// A shipped atmosphere by its name, or that of a `.ron` file.
///
/// # Errors
/// [`CliError::Read`], [`CliError::Table`] with the file and what is wrong in it, a name that does not exist.
pub fn atmosphere(name: &str) -> Result<Atmosphere, CliError> {
    named_or_file(name, Atmosphere::named, Atmosphere::from_ron)
}

fn sky(args: &SkyArgs) -> Result<(), CliError> {
    for path in [Some(&args.out), args.errors.as_ref()]
        .into_iter()
        .flatten()
    {
        Format::of(path)?;
        check_folder(path)?;
    }
    if args.errors.is_some() && args.path != How::Reference {
        return Err(CliError::argument(
            "--errors",
            "given",
            "left out for paths other than `reference`, which alone knows its errors",
        ));
    }
    let mut air = atmosphere(&args.atmosphere)?;
    if let Some(albedo) = args.albedo {
        air.ground_albedo = [albedo; 3];
        air.check()?;
    }
    let numbers = Table::read(&args.rays, 8)?.to_numbers(&args.rays)?;
    let rays = numbers
        .as_chunks::<8>()
        .0
        .iter()
        .enumerate()
        .map(|(row, numbers)| ProbeRay::from_row(row, *numbers))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| CliError::Table {
            path: args.rays.clone(),
            what: e.to_string(),
        })?;
    let orders = match args.orders {
        Which::Single => Orders::Single,
        Which::All => Orders::All,
    };
    let path = match args.path {
        How::Reference => None,
        How::Textbook => Some(ProbePath::Textbook),
        How::Fast => Some(ProbePath::Fast),
    };
    let mut light: Vec<u32> = Vec::with_capacity(6 * rays.len());
    if let Some(path) = path {
        let preset = Preset::Named(args.preset.clone().into());
        let settings = Settings::resolve(veduta::programs(), &preset, None, &[])?;
        let options = ProbeOptions {
            path,
            orders,
            quality: SkyQuality::of(&settings),
            ..Default::default()
        };
        for found in probe(veduta::device::shared()?, &air, &rays, &options)? {
            light.extend(found.in_scatter.map(f32::to_bits));
            light.extend(found.transmittance.map(f32::to_bits));
        }
    } else {
        let effort = reference::probe::Effort {
            samples: args.samples as usize,
            seed: args.seed,
            ..Default::default()
        };
        let bits = |value: f64| (value as f32).to_bits();
        let found = reference::probe::probe(&air, &rays, orders, &effort)?;
        for found in &found {
            light.extend(found.in_scatter.map(bits));
            light.extend(found.transmittance.map(bits));
        }
        if let Some(path) = &args.errors {
            let errors: Vec<u32> = found.iter().flat_map(|f| f.error.map(bits)).collect();
            write_results(path, &errors, 3, ResultKind::F32)?;
        }
    }
    write_results(&args.out, &light, 6, ResultKind::F32)
}
