//! Heights of a land and where rays meet it, on the device.

use std::collections::HashMap;

use super::clipmap::{Clipmap, ClipmapOptions, Gaze, Searched, group, nearest_ground};
use super::field::field_kind;
use super::globe::{Globe, GlobeGround};
use super::globe_rays;
use super::ground::{Ground, Prepared};
use super::land::Land;
use super::map::Relief;
use super::noise::Place;
use super::rays::{RayPath, TerrainHit, TerrainRay};
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, compute};
use crate::program::ProgramSet;
use crate::programs::blocks::{Course as CourseBlock, Field as FieldBlock};
use crate::view::WorldPos;

/// A pipeline with the layouts of its groups.
pub(super) type Program = (wgpu::ComputePipeline, Vec<wgpu::BindGroupLayout>);

/// Rays of one origin from which on heights are baked around it: about as many as cost as much over the field itself (measured on llvmpipe).
const BAKED: usize = 16_384;

/// Rays and places of one dispatch.
const CHUNK: usize = 1 << 14;

/// Bytes of a ray over the field itself, of one over baked heights, of what they find, of a place and of its ground.
const LOOSE_ROW: usize = 48;
const BAKED_ROW: usize = 32;
const HIT: usize = 48;
const PLACE: usize = 24;
const GROUND: usize = 16;

/// Checks places of which heights are asked, and the footprint.
pub(super) fn check_places(positions: &[WorldPos], footprint: f32) -> Result<(), Error> {
    if !(footprint >= 0.0 && footprint.is_finite()) {
        return Err(Error::OutOfDomain {
            name: "footprint".to_owned(),
            value: footprint.to_string(),
            domain: "finite and at least 0 m".to_owned(),
        });
    }
    match positions.iter().position(|p| !p.frac.is_finite()) {
        Some(i) => Err(Error::OutOfDomain {
            name: format!("position {i}"),
            value: format!("{:?}", positions[i]),
            domain: "finite".to_owned(),
        }),
        None => Ok(()),
    }
}

/// How rays are followed over a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Way {
    Textbook,
    Bracket,
    Baked,
    Ball(bool),
}

#[derive(Debug)]
enum Shape {
    Plane(Box<Prepared<f32>>),
    Ball(Box<Globe<f32>>),
}

/// Asks the device for heights of a land and where rays meet it. It keeps its pipelines, which are made when they are needed first, and the heights that it has baked last, so that a host may
/// ask again and again.
///
/// ```no_run
/// # fn ask(gpu: &veduta::device::Gpu) -> Result<(), veduta::Error> {
/// use veduta::WorldPos;
/// use veduta::terrain::{Land, RayPath, TerrainQuery, TerrainRay};
/// let mut query = TerrainQuery::new(gpu, veduta::programs(), &Land::named("alps")?)?;
/// let origin = WorldPos::from_metres([0.0, 5000.0, 0.0].into());
/// let down = TerrainRay { origin, dir: [0.0, -1.0, 0.0], far: 1e4 };
/// let hit = query.ray_hits(&[down], 0.001, RayPath::Fast)?[0];
/// let ground = query.heights(&[origin], 0.0)?[0];
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct TerrainQuery {
    gpu: Gpu,
    programs: ProgramSet,
    land: Land,
    shape: Shape,
    relief: Relief,
    steps: u32,
    baked_from: usize,
    field: wgpu::Buffer,
    course: wgpu::Buffer,
    ways: HashMap<Way, Program>,
    places: Option<Program>,
    baked: Option<(u32, Clipmap)>,
}

impl TerrainQuery {
    /// Prepares a land; pipelines are made with the first query that needs them.
    ///
    /// # Errors
    /// As [`Land::check`]; [`Error::OutOfDomain`] for a height map that has not been read or is larger than the device's textures.
    pub fn new(gpu: &Gpu, programs: &ProgramSet, land: &Land) -> Result<TerrainQuery, Error> {
        land.check()?;
        let shape = if land.field.on_sphere() {
            Shape::Ball(Box::new(land.globe::<f32>()?))
        } else {
            Shape::Plane(Box::new(land.prepare::<f32>()?))
        };
        let map = match &shape {
            Shape::Plane(field) => field.map(),
            Shape::Ball(_) => None,
        };
        let mut relief = Relief::new(&gpu.device, map)?;
        let _ = relief.upload(&gpu.queue);
        let uniform = |label, size: usize| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Ok(TerrainQuery {
            field: uniform("veduta field", FieldBlock::SIZE),
            course: uniform("veduta course", CourseBlock::SIZE),
            gpu: gpu.clone(),
            programs: programs.clone(),
            land: land.clone(),
            shape,
            relief,
            steps: 0,
            baked_from: BAKED,
            ways: HashMap::new(),
            places: None,
            baked: None,
        })
    }

    /// Steps of a ray at most, in [1, 100,000]; a ray that has taken them ends as [`TerrainHit::capped`]. Without this they are 4000, and 16,000 for rays over the field itself.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`].
    pub fn set_steps(&mut self, steps: u32) -> Result<(), Error> {
        if !(1..=100_000).contains(&steps) {
            return Err(Error::OutOfDomain {
                name: "steps".to_owned(),
                value: steps.to_string(),
                domain: "in [1, 100000]".to_owned(),
            });
        }
        if self.steps != steps {
            self.ways.clear();
        }
        self.steps = steps;
        Ok(())
    }

    /// How many rays of one origin it takes before heights are baked around it, 16,384 if nothing is said: about as many as cost as much over the field itself on llvmpipe.
    pub fn set_baked_from(&mut self, rays: usize) {
        self.baked_from = rays.max(1);
    }

    /// The land at positions, the field with its sea, filtered by a footprint (m). Submits and waits.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a footprint that is not finite or below 0, for positions that are not finite, over a ball, where [`TerrainQuery::globe_heights`] answers, and for a program's own function where none is plugged
    /// in; the faults of [`ProgramSet::get`] and of making the pipeline; [`Error::Device`].
    pub fn heights(
        &mut self,
        positions: &[WorldPos],
        footprint: f32,
    ) -> Result<Vec<Ground<f32>>, Error> {
        check_places(positions, footprint)?;
        let Shape::Plane(field) = &self.shape else {
            return Err(Error::OutOfDomain {
                name: "field.domain".to_owned(),
                value: "Sphere".to_owned(),
                domain: "Plane; TerrainQuery::globe_heights takes a Sphere".to_owned(),
            });
        };
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        if self.places.is_none() {
            let kind = [field_kind(
                &self.programs,
                ("terrain_heights", &[]),
                &self.land.field,
            )?];
            let made = compute(device, &self.programs, "terrain_heights", &[], &kind)?;
            self.places = Some(made);
        }
        let Some((pipeline, layouts)) = &self.places else {
            return Ok(Vec::new());
        };
        let block = field.block(Place {
            cell: [0; 2],
            frac: [0.0; 2],
        });
        queue.write_buffer(&self.field, 0, &block.to_bytes());
        let mut results = Vec::with_capacity(positions.len());
        for part in positions.chunks(CHUNK) {
            let mut rows = Vec::with_capacity(part.len() * PLACE);
            for position in part {
                let place = field.place(*position);
                rows.extend(place.cell.iter().flat_map(|c| c.to_le_bytes()));
                rows.extend(place.frac.iter().flat_map(|f| f.to_le_bytes()));
                rows.extend(footprint.to_le_bytes());
                rows.extend([0; 4]);
            }
            let uniforms = [self.field.as_entire_binding()];
            let data = self.exchanged((pipeline, layouts), &uniforms, &rows, part.len(), GROUND)?;
            results.extend(data.chunks_exact(GROUND).map(|row| Ground {
                height: number(row, 0),
                lost: number(row, 4),
                slope: [number(row, 8), number(row, 12)],
            }));
        }
        Ok(results)
    }

    /// The field of a land on a ball below or above positions, filtered by a footprint (m), as the device computes it. Submits and waits. It keeps its pipeline.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for a footprint that is not finite or below 0, for positions that are not finite, and over a plane, where [`TerrainQuery::heights`] answers; the faults of
    /// [`ProgramSet::get`] and of making the pipeline; [`Error::Device`].
    pub fn globe_heights(
        &mut self,
        positions: &[WorldPos],
        footprint: f32,
    ) -> Result<Vec<GlobeGround<f32>>, Error> {
        check_places(positions, footprint)?;
        let Shape::Ball(globe) = &self.shape else {
            return Err(Error::OutOfDomain {
                name: "field.domain".to_owned(),
                value: "Plane".to_owned(),
                domain: "Sphere; TerrainQuery::heights takes a Plane".to_owned(),
            });
        };
        let program = match self.places.take() {
            Some(made) => made,
            None => globe_rays::places(&self.gpu, &self.programs, &self.land)?,
        };
        let program = self.places.insert(program);
        globe_rays::grounds(&self.gpu, program, globe, positions, footprint)
    }

    /// Follows rays. The footprint grows with the distance by `pixel_angle` (rad). Submits and waits. On the path `Fast` over a plane heights are baked around each origin of 16,384 rays or more ([`TerrainQuery::set_baked_from`]),
    /// whatever their order, and all other rays are followed together over the field itself: by steps of half a footprint, 5 cm and 1/2000 of the distance at the least, longer where the slope's bound
    /// shows them clear. Over a ball each ray starts where it comes below the highest ground, which is found in `f64`.
    ///
    /// # Errors
    /// As [`TerrainRay::check`], with the ray's index; [`Error::OutOfDomain`] for an angle that is not above 0, and for a program's own function where none is plugged in; the faults of [`ProgramSet::get`] and of making pipelines; [`Error::Device`].
    pub fn ray_hits(
        &mut self,
        rays: &[TerrainRay],
        pixel_angle: f32,
        path: RayPath,
    ) -> Result<Vec<TerrainHit>, Error> {
        for (i, ray) in rays.iter().enumerate() {
            ray.check(i)?;
        }
        if !(pixel_angle.is_finite() && pixel_angle > 0.0) {
            return Err(Error::OutOfDomain {
                name: "pixel_angle".to_owned(),
                value: pixel_angle.to_string(),
                domain: "finite and above 0 rad".to_owned(),
            });
        }
        let mut hits = vec![TerrainHit::MISS; rays.len()];
        if rays.is_empty() {
            return Ok(hits);
        }
        if let Shape::Ball(_) = self.shape {
            let way = Way::Ball(path == RayPath::Fast);
            self.compile(way)?;
            if let (Shape::Ball(globe), Some(program)) = (&self.shape, self.ways.get(&way)) {
                return globe_rays::hits(&self.gpu, program, globe, rays, pixel_angle);
            }
            return Ok(hits);
        }
        if path == RayPath::Textbook {
            let all: Vec<usize> = (0..rays.len()).collect();
            self.over_field(Way::Textbook, rays, &all, pixel_angle, &mut hits)?;
            return Ok(hits);
        }
        // Those that share an origin, in the order of the first of them.
        let mut known: HashMap<_, usize> = HashMap::new();
        let mut shared: Vec<Vec<usize>> = Vec::new();
        for (i, ray) in rays.iter().enumerate() {
            let origin = ray.origin.normalized();
            let key = (origin.cell, origin.frac.to_array().map(f32::to_bits));
            let at = *known.entry(key).or_insert_with(|| {
                shared.push(Vec::new());
                shared.len() - 1
            });
            shared[at].push(i);
        }
        let (many, few): (Vec<_>, Vec<_>) =
            shared.into_iter().partition(|s| s.len() >= self.baked_from);
        for indices in &many {
            self.over_baked(rays, indices, pixel_angle, &mut hits)?;
        }
        let few: Vec<usize> = few.into_iter().flatten().collect();
        self.over_field(Way::Bracket, rays, &few, pixel_angle, &mut hits)?;
        Ok(hits)
    }

    fn compile(&mut self, way: Way) -> Result<(), Error> {
        if self.ways.contains_key(&way) {
            return Ok(());
        }
        let steps = match (self.steps, way) {
            (0, Way::Bracket) => 16_000,
            (0, _) => 4000,
            (n, _) => n,
        };
        let device = &self.gpu.device;
        let steps_key = ("MAX_MARCHING_STEPS", f64::from(steps));
        let program = match way {
            Way::Ball(fast) => {
                let path = if fast {
                    RayPath::Fast
                } else {
                    RayPath::Textbook
                };
                globe_rays::program(&self.gpu, &self.programs, &self.land, path, steps)?
            }
            Way::Baked => {
                let variant: (&str, &[&str]) = ("terrain_rays", &["TERRAIN_FAST"]);
                let kind = field_kind(&self.programs, variant, &self.land.field)?;
                let constants = [kind, steps_key, ("REFINE_STEPS", 2.0)];
                compute(device, &self.programs, variant.0, variant.1, &constants)?
            }
            Way::Textbook | Way::Bracket => {
                let kind = field_kind(&self.programs, ("terrain_rays", &[]), &self.land.field)?;
                let bracket = f64::from(u8::from(way == Way::Bracket));
                let constants = [kind, steps_key, ("RAY_BRACKET", bracket)];
                compute(device, &self.programs, "terrain_rays", &[], &constants)?
            }
        };
        self.ways.insert(way, program);
        Ok(())
    }

    /// Rays from any number of origins, over the field itself.
    fn over_field(
        &mut self,
        way: Way,
        rays: &[TerrainRay],
        indices: &[usize],
        pixel_angle: f32,
        hits: &mut [TerrainHit],
    ) -> Result<(), Error> {
        if indices.is_empty() {
            return Ok(());
        }
        self.compile(way)?;
        let (Shape::Plane(field), Some((pipeline, layouts))) = (&self.shape, self.ways.get(&way))
        else {
            return Ok(());
        };
        let queue = &self.gpu.queue;
        let block = field.block(Place {
            cell: [0; 2],
            frac: [0.0; 2],
        });
        queue.write_buffer(&self.field, 0, &block.to_bytes());
        let bounds = field.bounds();
        let ladder = bounds.map_or([1e30; 17], |b| b.ladder(field.kind()));
        let mut steep = [[1e30_f32; 4]; 5];
        for (k, slope) in ladder.iter().enumerate() {
            steep[k / 4][k % 4] = *slope as f32;
        }
        let course = CourseBlock {
            ground_radius: self.land.planet_radius as f32,
            top: bounds.map_or(2e4, |b| b.maximum) as f32,
            steep,
            ..Default::default()
        };
        queue.write_buffer(&self.course, 0, &course.to_bytes());
        // Rays that never come down to the highest ground are not followed.
        let entry = |i: usize| {
            let search = field.search(self.land.planet_radius, &rays[i], 0.0, 1.0);
            Some((i, search.entry()?))
        };
        let followed: Vec<(usize, f64)> = indices.iter().filter_map(|i| entry(*i)).collect();
        for part in followed.chunks(CHUNK) {
            let mut rows = Vec::with_capacity(part.len() * LOOSE_ROW);
            for (i, near) in part {
                let ray = &rays[*i];
                let place = field.place(ray.origin);
                let [x, y, z] = ray.dir.map(|c| c as f32);
                let far = ray.far.min(TerrainRay::FARTHEST) as f32;
                let mut add = |numbers: &[f32]| {
                    rows.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
                };
                add(&[x, y, z, far]);
                add(&place.cell.map(|c| f32::from_bits(c.cast_unsigned())));
                add(&place.frac);
                let altitude = ray.origin.altitude() as f32;
                add(&[altitude, *near as f32, pixel_angle, 0.0]);
            }
            let uniforms = [&self.field, &self.course].map(wgpu::Buffer::as_entire_binding);
            let data = self.exchanged((pipeline, layouts), &uniforms, &rows, part.len(), HIT)?;
            for ((i, _), row) in part.iter().zip(data.chunks_exact(HIT)) {
                hits[*i] = found(row);
            }
        }
        Ok(())
    }

    /// What a program finds for rows, `count` of them, `size` bytes each. Submits and waits.
    fn exchanged(
        &self,
        (pipeline, layouts): (&wgpu::ComputePipeline, &[wgpu::BindGroupLayout]),
        uniforms: &[wgpu::BindingResource<'_>],
        rows: &[u8],
        count: usize,
        size: usize,
    ) -> Result<Vec<u8>, Error> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let exchange = Exchange::new(device, queue, rows, count * size);
        let read = [
            exchange.input.as_entire_binding(),
            wgpu::BindingResource::TextureView(&self.relief.view),
        ];
        let groups = [
            group(device, &layouts[0], uniforms),
            group(device, &layouts[1], &read),
            group(device, &layouts[2], &[exchange.output.as_entire_binding()]),
        ];
        let encoder = device.create_command_encoder(&Default::default());
        let workgroups = count.div_ceil(64) as u32;
        exchange.run(device, queue, encoder, pipeline, &groups, workgroups)
    }

    /// Rays from one origin, over heights that are baked around it.
    fn over_baked(
        &mut self,
        rays: &[TerrainRay],
        indices: &[usize],
        pixel_angle: f32,
        hits: &mut [TerrainHit],
    ) -> Result<(), Error> {
        self.compile(Way::Baked)?;
        let (Shape::Plane(field), Some((pipeline, layouts))) =
            (&self.shape, self.ways.get(&Way::Baked))
        else {
            return Ok(());
        };
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let farthest = indices
            .iter()
            .map(|i| rays[*i].far.min(TerrainRay::FARTHEST))
            .fold(1000.0, f64::max);
        // A texel about as wide as a pixel.
        let texels = match 3.5 / f64::from(pixel_angle) {
            n if n <= 300.0 => 256,
            n if n <= 700.0 => 512,
            _ => 1024,
        };
        let kept = self.baked.take();
        let mut clipmap = match kept {
            Some((side, clipmap)) if side == texels && clipmap.reach() >= farthest => clipmap,
            _ => {
                let options = ClipmapOptions {
                    texels,
                    reach: farthest,
                    ..ClipmapOptions::default()
                };
                Clipmap::new(device, &self.programs, &self.land, &options, false)?
            }
        };
        let eye = rays[indices[0]].origin;
        let block = field.block(field.place(eye)).to_bytes();
        queue.write_buffer(&self.field, 0, &block);
        let above = nearest_ground(field, eye);
        let gaze = Gaze {
            least: 0.35 * f64::from(pixel_angle) * above,
            near: above,
            far: farthest,
            pixel_angle: f64::from(pixel_angle),
            searched: Searched::Lens,
            azimuths: [0.0, std::f64::consts::TAU],
            sun: None,
        };
        let mut encoder = device.create_command_encoder(&Default::default());
        let _ = clipmap.prepare(queue, &mut encoder, eye, &gaze);
        let view = wgpu::BindingResource::TextureView;
        let [heights, sectors, places] = &clipmap.views;
        for part in indices.chunks(CHUNK) {
            let mut rows = Vec::with_capacity(BAKED_ROW * part.len());
            for i in part {
                let ray = &rays[*i];
                let [x, y, z] = ray.dir.map(|c| c as f32);
                let far = ray.far.min(TerrainRay::FARTHEST) as f32;
                for number in [0.0, 0.0, 0.0, far, x, y, z, pixel_angle] {
                    rows.extend(number.to_le_bytes());
                }
            }
            let exchange = Exchange::new(device, queue, &rows, HIT * part.len());
            let groups = [
                group(
                    device,
                    &layouts[0],
                    &[
                        self.field.as_entire_binding(),
                        clipmap.clip().as_entire_binding(),
                    ],
                ),
                group(
                    device,
                    &layouts[1],
                    &[
                        exchange.input.as_entire_binding(),
                        view(heights),
                        view(sectors),
                        view(places),
                        wgpu::BindingResource::Sampler(&clipmap.wrapping),
                        view(clipmap.relief()),
                    ],
                ),
                group(device, &layouts[2], &[exchange.output.as_entire_binding()]),
            ];
            let workgroups = part.len().div_ceil(64) as u32;
            let next = device.create_command_encoder(&Default::default());
            let recorded = std::mem::replace(&mut encoder, next);
            let data = exchange.run(device, queue, recorded, pipeline, &groups, workgroups)?;
            for (i, row) in part.iter().zip(data.chunks_exact(HIT)) {
                hits[*i] = found(row);
            }
        }
        self.baked = Some((texels, clipmap));
        Ok(())
    }
}

fn number(row: &[u8], at: usize) -> f32 {
    f32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]])
}

/// What a row of `terrain_rays` says.
fn found(row: &[u8]) -> TerrainHit {
    let wide = |k: usize| f64::from(number(row, k));
    let capped = i32::from_le_bytes([row[32], row[33], row[34], row[35]]) < 0;
    if wide(0) < 0.0 {
        return TerrainHit {
            capped,
            ..TerrainHit::MISS
        };
    }
    TerrainHit {
        distance: wide(0),
        normal: [wide(16), wide(20), wide(24)],
        height: wide(28),
        capped,
    }
}

/// [`TerrainQuery::ray_hits`] of a query that is made for the call, with the compilation of what it needs.
///
/// # Errors
/// As [`TerrainQuery::new`] and [`TerrainQuery::ray_hits`].
pub fn ray_hits(
    gpu: &Gpu,
    programs: &ProgramSet,
    land: &Land,
    rays: &[TerrainRay],
    pixel_angle: f32,
    path: RayPath,
) -> Result<Vec<TerrainHit>, Error> {
    TerrainQuery::new(gpu, programs, land)?.ray_hits(rays, pixel_angle, path)
}
