//! The tables of an atmosphere and of one eye in it: made on the device, and made anew only when what they depend on has changed.

use crate::error::Error;
use crate::exchange;
pub(super) use crate::exchange::bind_groups;
use crate::landscape::{Resources, Work};
use crate::program::ProgramSet;
use crate::programs::blocks::{SkyEye as EyeBlock, SkyLook as LookBlock};
use crate::settings::Settings;

use super::Atmosphere;

/// How finely the tables are made. Sizes are texels; a table's outermost texels hold the ends of its domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SkyQuality {
    /// Columns towards the sun: zenith angle by altitude, each in [2, 1024].
    pub columns: [u32; 2],
    /// Diffuse light: sun's height by altitude, each in [2, 1024].
    pub diffuse: [u32; 2],
    /// Sky: azimuth by height above the horizon, each in [2, 1024]. The table has four times as many rows and twice as many columns, interpolated by cubics.
    pub sky: [u32; 2],
    /// Steps on each stretch of a ray of the sky, in [1, 64].
    pub sky_steps: u32,
    /// Air before things: azimuth by height above and below the horizon; [2, 1024] and an even number in [4, 1024].
    pub aerial: [u32; 2],
    /// Distances of the air before things, in [2, 128].
    pub aerial_slices: u32,
    /// Steps between two of them, in [1, 8].
    pub aerial_steps: u32,
    /// Whether light of all orders of scattering is in the tables, or of the first alone.
    pub all_orders: bool,
}

impl SkyQuality {
    /// What a preset asks for.
    pub fn of(settings: &Settings) -> SkyQuality {
        let number = |name: &str| settings.number(name).unwrap_or(1.0) as u32;
        SkyQuality {
            columns: [number("COLUMNS_WIDTH"), number("COLUMNS_HEIGHT")],
            diffuse: [number("DIFFUSE_WIDTH"), number("DIFFUSE_HEIGHT")],
            sky: [number("SKY_WIDTH"), number("SKY_HEIGHT")],
            sky_steps: number("SKY_STEPS"),
            aerial: [number("AERIAL_WIDTH"), number("AERIAL_HEIGHT")],
            aerial_slices: number("AERIAL_SLICES"),
            aerial_steps: number("AERIAL_STEPS"),
            all_orders: number("ALL_ORDERS") != 0,
        }
    }

    /// Fine enough that refining further changes nothing that a picture shows.
    pub fn finest() -> SkyQuality {
        SkyQuality {
            columns: [256, 64],
            diffuse: [96, 32],
            sky: [64, 256],
            sky_steps: 32,
            aerial: [48, 128],
            aerial_slices: 64,
            aerial_steps: 4,
            all_orders: true,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        let within = |name: &str, value: u32, from: u32, to: u32| {
            if (from..=to).contains(&value) {
                return Ok(());
            }
            Err(Error::OutOfDomain {
                name: format!("sky_quality.{name}"),
                value: value.to_string(),
                domain: format!("in [{from}, {to}]"),
            })
        };
        for (name, size) in [
            ("columns", self.columns),
            ("diffuse", self.diffuse),
            ("sky", self.sky),
            ("aerial", self.aerial),
        ] {
            within(name, size[0], 2, 1024)?;
            within(name, size[1], 2, 1024)?;
        }
        within("aerial_slices", self.aerial_slices, 2, 128)?;
        within("sky_steps", self.sky_steps, 1, 64)?;
        within("aerial_steps", self.aerial_steps, 1, 8)?;
        if self.aerial[1] < 4 || self.aerial[1] % 2 == 1 {
            return Err(Error::OutOfDomain {
                name: "sky_quality.aerial".to_owned(),
                value: self.aerial[1].to_string(),
                domain: "an even number of rows, at least 4".to_owned(),
            });
        }
        Ok(())
    }
}

/// Rows that the table of the sky has for each that is computed.
const ROWS_OF_EACH: u32 = 4;

/// Columns that it has for each but the last.
const COLUMNS_OF_EACH: u32 = 2;

/// Texels of the table of the sky that pictures read.
fn fine_size(quality: &SkyQuality) -> [u32; 2] {
    let [columns, rows] = quality.sky;
    [(columns - 1) * COLUMNS_OF_EACH + 1, rows * ROWS_OF_EACH]
}

/// Where an eye is, as far as the tables depend on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eye {
    /// Altitude in [0, 1e9] m.
    pub altitude: f64,
    /// Unit vector to the sun, y up at the eye.
    pub to_sun: [f64; 3],
    /// Angular radius of the sun in [0, 0.5] rad; 0 for a point.
    pub sun_angular_radius: f64,
}

impl Eye {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        let fault = |name: &str, value: String, domain: &str| {
            Err(Error::OutOfDomain {
                name: format!("eye.{name}"),
                value,
                domain: domain.to_owned(),
            })
        };
        if !(0.0..=1e9).contains(&self.altitude) {
            return fault("altitude", self.altitude.to_string(), "in [0, 1e9] m");
        }
        let length = self.to_sun.iter().map(|c| c * c).sum::<f64>().sqrt();
        if (length - 1.0).abs() > 1e-3 || length.is_nan() {
            return fault("to_sun", format!("{:?}", self.to_sun), "a unit vector");
        }
        if !(0.0..=0.5).contains(&self.sun_angular_radius) {
            return fault(
                "sun_angular_radius",
                self.sun_angular_radius.to_string(),
                "in [0, 0.5] rad",
            );
        }
        Ok(())
    }
}

/// A texture with a view of all of it.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) texture: wgpu::Texture,
    pub(super) view: wgpu::TextureView,
}

impl Table {
    pub(super) fn new(
        device: &wgpu::Device,
        label: &str,
        size: [u32; 2],
        layers: Option<u32>,
    ) -> Table {
        Table::of(
            device,
            label,
            wgpu::TextureFormat::Rgba16Float,
            size,
            layers,
        )
    }

    fn of(
        device: &wgpu::Device,
        label: &str,
        format: wgpu::TextureFormat,
        [width, height]: [u32; 2],
        layers: Option<u32>,
    ) -> Table {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: layers.unwrap_or(1),
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(if layers.is_some() {
                wgpu::TextureViewDimension::D2Array
            } else {
                wgpu::TextureViewDimension::D2
            }),
            ..Default::default()
        });
        Table { texture, view }
    }

    pub(super) fn bytes(&self) -> u64 {
        let size = self.texture.size();
        let texel = self.texture.format().block_copy_size(None).unwrap_or(0);
        u64::from(texel)
            * u64::from(size.width)
            * u64::from(size.height)
            * u64::from(size.depth_or_array_layers)
    }
}

/// A pass over a table.
#[derive(Debug)]
pub(super) struct Bake {
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) groups: Vec<wgpu::BindGroup>,
    pub(super) workgroups: [u32; 2],
}

impl Bake {
    pub(super) fn record(&self, encoder: &mut wgpu::CommandEncoder, label: &str, work: &mut Work) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(label),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        for (group, index) in self.groups.iter().zip(0..) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.dispatch_workgroups(self.workgroups[0], self.workgroups[1], 1);
        work.bakes += 1;
        work.dispatches += 1;
    }
}

/// Writes a buffer when its bytes have changed.
pub(super) fn upload(
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
    held: &mut Vec<u8>,
    bytes: Vec<u8>,
    work: &mut Work,
) {
    if *held != bytes {
        queue.write_buffer(buffer, 0, &bytes);
        work.writes += 1;
        work.bytes += bytes.len() as u64;
        *held = bytes;
    }
}

/// The pipeline of a compute program for an atmosphere, with its layouts.
pub(super) fn compute(
    device: &wgpu::Device,
    programs: &ProgramSet,
    atmosphere: &Atmosphere,
    name: &str,
    constants: &[(&str, f64)],
) -> Result<(wgpu::ComputePipeline, Vec<wgpu::BindGroupLayout>), Error> {
    exchange::compute(device, programs, name, atmosphere.features(), constants)
}

/// The tables of one atmosphere and one eye.
///
/// - *Columns*: how much of every layer lies between a place and the sun; depends on the radius, the thickness and the profiles.
/// - *Diffuse light*: moments of the light of all orders around a place; depends on the layers and the ground.
/// - *Sky* and *air before things*: radiance in the directions of one eye; depend on the above, the eye's altitude, the sun's
///   height and its angular radius. Turning the eye, or the sun about the vertical, makes nothing anew.
///
/// All are `Rgba16Float`; payload, units and mapping stand in the modules `veduta::atmosphere::{columns, diffuse, sky_view,
/// aerial}`.
#[derive(Debug)]
pub struct SkyTables {
    atmosphere: Atmosphere,
    quality: SkyQuality,
    shows_ground: bool,
    air: wgpu::Buffer,
    eye: wgpu::Buffer,
    look: wgpu::Buffer,
    sampler: wgpu::Sampler,
    columns: Table,
    moments: [Table; 4],
    /// Rows and columns of the sky that are computed.
    sky_computed: Table,
    /// The sky with further columns between those.
    sky_columns: Table,
    /// The same with further rows.
    sky: Table,
    /// Light and depths of the air before things, and the pass that makes them.
    before: Option<Before>,
    bake_columns: Bake,
    bake_moments: Vec<Bake>,
    bake_sky: [Bake; 3],
    /// What the buffer `air` holds.
    air_bytes: Vec<u8>,
    /// What the buffer `eye` holds.
    eye_bytes: Vec<u8>,
    /// What the buffer `look` holds.
    look_bytes: Vec<u8>,
    columns_of: Option<Vec<u8>>,
    moments_of: Option<Vec<u8>>,
    eye_of: Option<EyeKey>,
    /// All that has been done since the tables are there.
    work: Work,
}

/// The tables of the air before things.
#[derive(Debug)]
struct Before {
    light: Table,
    depths: Table,
    bake: Bake,
}

/// What the tables of an eye depend on, besides the air.
#[derive(Debug, Clone, Copy, PartialEq)]
struct EyeKey {
    altitude: f32,
    sun_height: f32,
    sun_angular_radius: f32,
    scale: f32,
}

impl SkyTables {
    /// Makes textures and pipelines; the tables themselves are made by the first [`SkyTables::prepare`].
    ///
    /// # Errors
    /// As [`Atmosphere::check`] and [`SkyQuality::check`], and the faults of [`ProgramSet::get`] and of making pipelines.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        atmosphere: &Atmosphere,
        quality: &SkyQuality,
    ) -> Result<SkyTables, Error> {
        SkyTables::build(device, programs, atmosphere, quality, [false, true])
    }

    /// As [`SkyTables::new`], but the table of the sky shows the bare ground in directions below the horizon.
    ///
    /// # Errors
    /// As [`SkyTables::new`].
    pub fn with_ground(
        device: &wgpu::Device,
        programs: &ProgramSet,
        atmosphere: &Atmosphere,
        quality: &SkyQuality,
    ) -> Result<SkyTables, Error> {
        SkyTables::build(device, programs, atmosphere, quality, [true, true])
    }

    /// As [`SkyTables::with_ground`]; without the air before things unless a picture asks for it.
    pub(super) fn of_sky(
        device: &wgpu::Device,
        programs: &ProgramSet,
        atmosphere: &Atmosphere,
        quality: &SkyQuality,
        before: bool,
    ) -> Result<SkyTables, Error> {
        SkyTables::build(device, programs, atmosphere, quality, [true, before])
    }

    fn build(
        device: &wgpu::Device,
        programs: &ProgramSet,
        atmosphere: &Atmosphere,
        quality: &SkyQuality,
        [ground, before]: [bool; 2],
    ) -> Result<SkyTables, Error> {
        quality.check()?;
        let bytes = atmosphere.air_bytes()?;
        let buffer = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let air = buffer("veduta air", bytes.len() as u64);
        let eye = buffer("veduta eye", EyeBlock::SIZE as u64);
        let look = buffer("veduta look at the sky", LookBlock::SIZE as u64);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("veduta tables"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        // A second layer for lanes 4 to 7 is there in any case: eight lanes are a matter of content.
        let columns = Table::new(device, "veduta columns", quality.columns, Some(2));
        let moments =
            [(); 4].map(|()| Table::new(device, "veduta diffuse light", quality.diffuse, Some(3)));
        let fine = fine_size(quality);
        let between = [fine[0], quality.sky[1]];
        // Whole floats, since rounding would be carried on between rows and columns.
        let float = wgpu::TextureFormat::Rgba32Float;
        let sky_computed = Table::of(device, "veduta sky", float, quality.sky, Some(2));
        let sky_columns = Table::of(
            device,
            "veduta sky between its columns",
            float,
            between,
            Some(2),
        );
        let sky = Table::new(device, "veduta sky between its rows", fine, Some(2));
        let air_bound = (0, air.as_entire_binding());
        let eye_bound = (1, eye.as_entire_binding());
        let linear = (0, wgpu::BindingResource::Sampler(&sampler));
        fn at(binding: u32, table: &Table) -> (u32, wgpu::BindingResource<'_>) {
            (binding, wgpu::BindingResource::TextureView(&table.view))
        }
        let groups_of =
            |size: [u32; 2], of: [u32; 2]| [size[0].div_ceil(of[0]), size[1].div_ceil(of[1])];

        let (pipeline, layouts) = compute(device, programs, atmosphere, "air_columns", &[])?;
        let bake_columns = Bake {
            pipeline,
            groups: bind_groups(
                device,
                "veduta columns",
                &layouts,
                &[std::slice::from_ref(&air_bound), &[], &[at(0, &columns)]],
            ),
            workgroups: groups_of(quality.columns, [8, 8]),
        };
        let mut bake_moments = Vec::new();
        // The first order reads no other, the second the first; the last reads the order before and the sum of those before that. Orders between, in pairs, read and write the
        // same. What is not read is any table but those written.
        for (order, [before, earlier, written, sums]) in [
            (1, [1, 2, 0, 3]),
            (2, [0, 2, 1, 3]),
            (4, [1, 0, 2, 3]),
            (4, [2, 3, 1, 0]),
            (3, [1, 0, 2, 3]),
        ] {
            let (pipeline, layouts) = compute(
                device,
                programs,
                atmosphere,
                "air_diffuse",
                &[("SCATTERING_ORDER", f64::from(order))],
            )?;
            bake_moments.push(Bake {
                pipeline,
                groups: bind_groups(
                    device,
                    "veduta diffuse light",
                    &layouts,
                    &[
                        std::slice::from_ref(&air_bound),
                        &[
                            linear.clone(),
                            at(1, &columns),
                            at(2, &moments[before]),
                            at(3, &moments[earlier]),
                        ],
                        &[at(0, &moments[written]), at(1, &moments[sums])],
                    ],
                ),
                workgroups: groups_of(quality.diffuse, [4, 4]),
            });
        }
        let all = f64::from(u8::from(quality.all_orders));
        let (pipeline, layouts) = compute(
            device,
            programs,
            atmosphere,
            "sky_view",
            &[
                ("SKY_STEPS", f64::from(quality.sky_steps)),
                ("ALL_ORDERS", all),
                ("SKY_GROUND", f64::from(u8::from(ground))),
            ],
        )?;
        let read = [linear.clone(), at(1, &columns), at(2, &moments[2])];
        let bake_sky = Bake {
            pipeline,
            groups: bind_groups(
                device,
                "veduta sky",
                &layouts,
                &[
                    &[air_bound.clone(), eye_bound.clone()],
                    &read,
                    &[at(0, &sky_computed)],
                ],
            ),
            workgroups: groups_of(quality.sky, [8, 8]),
        };
        let (pipeline, layouts) = compute(device, programs, atmosphere, "sky_columns", &[])?;
        let refine_columns = Bake {
            pipeline,
            groups: bind_groups(
                device,
                "veduta sky between its columns",
                &layouts,
                &[&[], &[at(0, &sky_computed)], &[at(0, &sky_columns)]],
            ),
            workgroups: groups_of(quality.sky, [8, 8]),
        };
        let (pipeline, layouts) = compute(device, programs, atmosphere, "sky_refine", &[])?;
        let refine_rows = Bake {
            pipeline,
            groups: bind_groups(
                device,
                "veduta sky between its rows",
                &layouts,
                &[
                    std::slice::from_ref(&eye_bound),
                    &[at(0, &sky_columns)],
                    &[at(0, &sky)],
                ],
            ),
            workgroups: groups_of(between, [8, 8]),
        };
        let before = if before {
            let [width, height] = quality.aerial;
            let slices = quality.aerial_slices;
            let light = Table::new(
                device,
                "veduta air before things",
                [width, height],
                Some(2 * slices),
            );
            let depths = Table::new(device, "veduta depths", [slices, height], None);
            let (pipeline, layouts) = compute(
                device,
                programs,
                atmosphere,
                "sky_aerial",
                &[
                    ("AERIAL_STEPS", f64::from(quality.aerial_steps)),
                    ("AERIAL_SLICES", f64::from(slices)),
                    ("ALL_ORDERS", all),
                ],
            )?;
            let groups = bind_groups(
                device,
                "veduta air before things",
                &layouts,
                &[
                    &[air_bound, eye_bound],
                    &read,
                    &[at(0, &light), at(1, &depths)],
                ],
            );
            let bake = Bake {
                pipeline,
                groups,
                workgroups: groups_of(quality.aerial, [4, 8]),
            };
            Some(Before {
                light,
                depths,
                bake,
            })
        } else {
            None
        };
        Ok(SkyTables {
            atmosphere: atmosphere.clone(),
            quality: *quality,
            shows_ground: ground,
            air,
            eye,
            look,
            sampler,
            columns,
            moments,
            sky_computed,
            sky_columns,
            sky,
            before,
            bake_columns,
            bake_moments,
            bake_sky: [bake_sky, refine_columns, refine_rows],
            air_bytes: Vec::new(),
            eye_bytes: Vec::new(),
            look_bytes: Vec::new(),
            columns_of: None,
            moments_of: None,
            eye_of: None,
            work: Work::default(),
        })
    }

    /// The air that the tables are of.
    pub fn atmosphere(&self) -> &Atmosphere {
        &self.atmosphere
    }

    /// How finely they are made.
    pub fn quality(&self) -> &SkyQuality {
        &self.quality
    }

    /// Changes the air; the next [`SkyTables::prepare`] makes anew what depends on the change.
    ///
    /// # Errors
    /// As [`Atmosphere::check`]; [`Error::OutOfDomain`] for an air that needs other programs, which [`Atmosphere::features`] tells.
    pub fn set_atmosphere(&mut self, atmosphere: &Atmosphere) -> Result<(), Error> {
        atmosphere.check()?;
        atmosphere.check_features("atmosphere.layers", self.atmosphere.features())?;
        self.atmosphere = atmosphere.clone();
        Ok(())
    }

    /// Uploads what has changed and records what has to be made anew for an eye. Tables count as made once they are recorded: submit the encoder before
    /// anything reads them, or call [`SkyTables::forget`] when it is dropped instead.
    ///
    /// # Errors
    /// As [`Eye::check`].
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        eye: &Eye,
    ) -> Result<Work, Error> {
        eye.check()?;
        let block = self.eye_block(eye);
        let look = self.look_block(&block).to_bytes().to_vec();
        let (mut work, air_anew) = self.air_work(queue, encoder)?;
        upload(
            queue,
            &self.eye,
            &mut self.eye_bytes,
            block.to_bytes().to_vec(),
            &mut work,
        );
        upload(queue, &self.look, &mut self.look_bytes, look, &mut work);
        let key = EyeKey {
            altitude: block.altitude,
            sun_height: block.to_sun[1],
            sun_angular_radius: block.sun_angular_radius,
            scale: block.scale,
        };
        if air_anew {
            self.eye_of = None;
        }
        if self.eye_of != Some(key) {
            for pass in &self.bake_sky {
                pass.record(encoder, "veduta sky", &mut work);
            }
            if let Some(before) = &self.before {
                before
                    .bake
                    .record(encoder, "veduta air before things", &mut work);
            }
            self.eye_of = Some(key);
        }
        self.work += work;
        Ok(work)
    }

    /// Counts no table as made: the next [`SkyTables::prepare`] records them all. For a host that has dropped an encoder with tables in it, or whose
    /// device has failed to run it.
    pub fn forget(&mut self) {
        self.columns_of = None;
        self.moments_of = None;
        self.eye_of = None;
    }

    /// All work on these tables since they are there, that of queries ([`SkyQuery`](super::SkyQuery), [`FastProbe`](super::FastProbe)) included: the
    /// difference of two calls is what was done between them.
    pub fn total_work(&self) -> Work {
        self.work
    }

    /// As [`SkyTables::prepare`], but only what does not depend on an eye: columns and diffuse light.
    ///
    /// # Errors
    /// As [`Atmosphere::check`].
    pub fn prepare_air(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<Work, Error> {
        let (work, air_anew) = self.air_work(queue, encoder)?;
        if air_anew {
            self.eye_of = None;
        }
        self.work += work;
        Ok(work)
    }

    /// What is made anew of the air, and whether anything was that the tables of an eye depend on.
    fn air_work(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<(Work, bool), Error> {
        let mut work = Work::default();
        let bytes = self.atmosphere.air_bytes()?;
        upload(queue, &self.air, &mut self.air_bytes, bytes, &mut work);
        let shape = self.atmosphere.profile_bytes();
        if self.columns_of.as_ref() != Some(&shape) {
            self.bake_columns
                .record(encoder, "veduta columns", &mut work);
            self.columns_of = Some(shape);
        }
        let air_anew = self.moments_of.as_ref() != Some(&self.air_bytes);
        if air_anew {
            if self.quality.all_orders
                && let [first, second, between @ .., last] = &self.bake_moments[..]
            {
                let pairs = pairs_between(&self.atmosphere);
                let between = (0..pairs).flat_map(|_| between);
                for pass in [first, second].into_iter().chain(between).chain([last]) {
                    pass.record(encoder, "veduta diffuse light", &mut work);
                }
            }
            self.moments_of = Some(self.air_bytes.clone());
        }
        Ok((work, air_anew))
    }

    fn eye_block(&self, eye: &Eye) -> EyeBlock {
        let radius = self.atmosphere.planet_radius;
        let r = radius + eye.altitude;
        let sine = radius / r;
        let cosine = -(eye.altitude * (2.0 * radius + eye.altitude)).sqrt() / r;
        let length = eye.to_sun.iter().map(|c| c * c).sum::<f64>().sqrt();
        let to_sun = eye.to_sun.map(|c| c / length);
        EyeBlock {
            to_sun: to_sun.map(|c| c as f32),
            altitude: eye.altitude as f32,
            horizon: (sine / (1.0 + cosine)) as f32,
            ground_radius: radius as f32,
            top: self.atmosphere.thickness as f32,
            scale: table_scale(&self.atmosphere, eye.altitude, to_sun[1]),
            sun_angular_radius: eye.sun_angular_radius as f32,
            shows_ground: u32::from(self.shows_ground),
            ..EyeBlock::ZERO
        }
    }

    fn look_block(&self, eye: &EyeBlock) -> LookBlock {
        let [width, rows] = fine_size(&self.quality).map(f64::from);
        let [sx, _, sz] = eye.to_sun.map(f64::from);
        let flat = sx.hypot(sz);
        let across = 0.5 * (width - 1.0) / width;
        let ahead = if flat > 1e-10 {
            [sx, sz].map(|c| (across * c / flat) as f32)
        } else {
            [0.0; 2]
        };
        let above = (0.75 * rows).floor();
        let peak = self.atmosphere.peak();
        let (g, level, square) = peak.map_or((0.0, 0.0, 0.0), |p| (p.g, p.level, p.square));
        LookBlock {
            to_sun: eye.to_sun,
            horizon: eye.horizon,
            ahead,
            above: (0.5 / rows) as f32,
            above_rise: ((above - 1.0) / rows) as f32,
            below: ((above + 0.5) / rows) as f32,
            below_rise: ((rows - above - 1.0) / rows) as f32,
            gain: eye.scale.recip(),
            peak_base: (1.0 + g * g) as f32,
            peak_slope: (2.0 * g) as f32,
            peak_level: level as f32,
            peak_square: square as f32,
            ..LookBlock::ZERO
        }
    }

    /// What the tables keep on the device.
    pub fn resources(&self) -> Resources {
        let before = self.before.as_ref();
        let tables: Vec<&Table> = [
            &self.columns,
            &self.sky_computed,
            &self.sky_columns,
            &self.sky,
        ]
        .into_iter()
        .chain(before.into_iter().flat_map(|b| [&b.light, &b.depths]))
        .chain(&self.moments)
        .collect();
        let bakes: Vec<&Bake> = std::iter::once(&self.bake_columns)
            .chain(&self.bake_sky)
            .chain(before.map(|b| &b.bake))
            .chain(&self.bake_moments)
            .collect();
        Resources {
            pipelines: bakes.len() as u32,
            bind_groups: bakes.iter().map(|b| b.groups.len() as u32).sum(),
            bindings: 2 + 5 * 6 + 6 + 2 + 3 + if before.is_some() { 7 } else { 0 },
            buffers: 3,
            buffer_bytes: self.air.size() + self.eye.size() + self.look.size(),
            textures: tables.len() as u32,
            texture_bytes: tables.iter().map(|t| t.bytes()).sum(),
            samplers: 1,
        }
    }

    /// The block `Air` of the modules.
    pub fn air(&self) -> &wgpu::Buffer {
        &self.air
    }

    /// The block `SkyEye` of the modules.
    pub fn eye(&self) -> &wgpu::Buffer {
        &self.eye
    }

    /// The block `SkyLook` of the modules; for an eye within the air.
    pub fn look(&self) -> &wgpu::Buffer {
        &self.look
    }

    /// The sampler that the tables are read with.
    pub fn sampler(&self) -> &wgpu::Sampler {
        &self.sampler
    }

    /// The table of columns.
    pub fn columns(&self) -> &wgpu::TextureView {
        &self.columns.view
    }

    /// The table of diffuse light.
    pub fn diffuse(&self) -> &wgpu::TextureView {
        &self.moments[2].view
    }

    /// The table of the sky.
    pub fn sky(&self) -> &wgpu::TextureView {
        &self.sky.view
    }

    /// The light of the air before things; none in the tables of a [`Sky`](super::Sky) that draws nothing before the host's picture.
    pub fn aerial(&self) -> Option<&wgpu::TextureView> {
        self.before.as_ref().map(|before| &before.light.view)
    }

    /// The mean extinction of the air before things; as [`SkyTables::aerial`].
    pub fn aerial_depths(&self) -> Option<&wgpu::TextureView> {
        self.before.as_ref().map(|before| &before.depths.view)
    }
}

/// Pairs of orders of scattering between the second and the last: none for air through which light from the zenith is scattered at most half a time, and the more the
/// thicker the air is, since the ratio of an order to the one before takes the longer to settle.
fn pairs_between(atmosphere: &Atmosphere) -> usize {
    let depth = |c: usize| -> f64 {
        let layers = atmosphere.layers.iter();
        let above = |layer: &super::Layer| {
            // Dense at the ground.
            let nodes = (0..256).map(|i| (f64::from(i) + 0.5) / 256.0);
            let mean =
                |x: f64| 2.0 * x * layer.profile.density(atmosphere.thickness * x * x) / 256.0;
            nodes.map(mean).sum::<f64>() * atmosphere.thickness
        };
        layers.map(|layer| layer.scattering[c] * above(layer)).sum()
    };
    let depth = (0..3).map(depth).fold(0.0, f64::max);
    (3.0 * (depth - 0.5)).ceil().clamp(0.0, MOST_PAIRS) as usize
}

/// Most pairs of orders between.
const MOST_PAIRS: f64 = 16.0;

/// Altitude, in thicknesses of the air, above which the sky's table holds codes, as in `veduta::atmosphere::sky_view`.
const CODED: f64 = 0.1;

/// Where the estimate of the brightest light is put in half precision, as a power of two: far above the numbers below 2^-14, which are coarse, and with room for
/// what the estimate misses.
const AIM: f64 = 8.0;

/// What radiance in the tables of an eye is multiplied with, a power of two: so that half precision is enough from noon to night. It
/// follows an estimate, in f64, of the brightest light that the eye sees scattered once.
fn table_scale(atmosphere: &Atmosphere, altitude: f64, sun_mu: f64) -> f32 {
    let lanes = atmosphere.lanes();
    let radius = atmosphere.planet_radius;
    let top = atmosphere.thickness;
    let sun_sine = (1.0 - sun_mu * sun_mu).max(0.0).sqrt();
    // Places in the plane of the sun, as altitude and angle from the eye about the planet's centre towards the sun.
    let mut brightest = 0.0_f64;
    for step in -8..=8 {
        // As far as an eye on the ground, or one above the limb, may see.
        let reach =
            (radius / (radius + altitude.max(1.0))).acos() + (radius / (radius + top)).acos();
        let angle = reach * f64::from(step) / 8.0;
        let there_mu = sun_mu * angle.cos() + sun_sine * angle.sin();
        // Below this the ground hides what lies there.
        let beyond = (angle.abs() - (radius / (radius + altitude.max(1.0))).acos()).max(0.0);
        let hidden = radius * (1.0 / beyond.cos() - 1.0);
        for level in 0..12 {
            let h = top * (f64::from(level) / 12.0).powi(2);
            if h < hidden {
                continue;
            }
            let horizon = -(h * (2.0 * radius + h)).sqrt() / (radius + h);
            if there_mu < horizon {
                continue;
            }
            let slant = 1.0 / (there_mu - horizon + 0.03);
            for channel in 0..3 {
                let (mut scattered, mut depth) = (0.0, 0.0);
                for lane in &lanes {
                    let density = lane.profile.density(h);
                    let depth_scale = match lane.profile {
                        super::Profile::Exponential { scale_height } => scale_height,
                        _ => 0.1 * top,
                    };
                    scattered += lane.scattering[channel] * density * depth_scale;
                    depth += lane.extinction[channel] * density * depth_scale * slant;
                }
                brightest = brightest.max(scattered * (-depth).exp());
            }
        }
    }
    // The estimate is of the brightest place of all; half precision is even down to 6e-5 and ends at 65504, so that light is aimed above 1. Codes are even about 1.
    let coded = altitude > CODED * top;
    let aim = if coded { 0.0 } else { AIM };
    let exponent = aim - brightest.max(1e-9).log2().round().clamp(-30.0, 4.0);
    exponent.exp2() as f32
}
