//! Heights of given places of a ball on the device, and where given rays meet it.

use super::clipmap::group;
use super::field::Domain;
use super::globe::{Globe, GlobeGround};
use super::land::Land;
use super::query::{Program, TerrainQuery};
use super::rays::{RayPath, TerrainHit, TerrainRay};
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{Exchange, compute, three};
use crate::program::ProgramSet;
use crate::programs::blocks::Globe as GlobeBlock;
use crate::view::WorldPos;

/// Rows of one dispatch.
const CHUNK: usize = 1 << 14;

fn uniform(gpu: &Gpu, block: &GlobeBlock) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("veduta globe"),
        size: GlobeBlock::SIZE as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, &block.to_bytes());
    buffer
}

/// Runs a program on rows of so many bytes; results have so many.
fn run(
    gpu: &Gpu,
    (pipeline, layouts): &Program,
    globe: &wgpu::Buffer,
    rows: &[u8],
    sizes: [usize; 2],
) -> Result<Vec<u8>, Error> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let mut results = Vec::with_capacity(rows.len() / sizes[0] * sizes[1]);
    for part in rows.chunks(CHUNK * sizes[0]) {
        let count = part.len() / sizes[0];
        let exchange = Exchange::new(device, queue, part, count * sizes[1]);
        let groups: Vec<wgpu::BindGroup> = layouts
            .iter()
            .zip([globe, &exchange.input, &exchange.output])
            .map(|(layout, buffer)| group(device, layout, &[buffer.as_entire_binding()]))
            .collect();
        let encoder = device.create_command_encoder(&Default::default());
        let workgroups = count.div_ceil(64) as u32;
        results.extend(exchange.run(device, queue, encoder, pipeline, &groups, workgroups)?);
    }
    Ok(results)
}

fn words<const N: usize>(rows: &mut Vec<u8>, numbers: [f32; N]) {
    rows.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
}

fn cells(rows: &mut Vec<u8>, cell: [i32; 3]) {
    rows.extend(cell.iter().flat_map(|c| c.to_le_bytes()));
}

fn number(row: &[u8], at: usize) -> f32 {
    f32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]])
}

/// [`TerrainQuery::globe_heights`] of a query that is made for the call, with the compilation of what it needs: the field of a land on a ball below or above positions, filtered by a footprint (m),
/// as the device computes it. Submits and waits.
///
/// # Errors
/// As [`Land::globe`] and [`TerrainQuery::globe_heights`].
pub fn globe_heights(
    gpu: &Gpu,
    programs: &ProgramSet,
    land: &Land,
    positions: &[WorldPos],
    footprint: f32,
) -> Result<Vec<GlobeGround<f32>>, Error> {
    if land.field.domain != Domain::Sphere {
        // It says which function takes a plane.
        land.globe::<f32>()?;
    }
    TerrainQuery::new(gpu, programs, land)?.globe_heights(positions, footprint)
}

/// The program that finds heights of places on a ball.
pub(super) fn places(gpu: &Gpu, programs: &ProgramSet, land: &Land) -> Result<Program, Error> {
    let kind = [("FIELD_KIND", f64::from(land.field.kind.number()))];
    compute(&gpu.device, programs, "terrain_globe_heights", &[], &kind)
}

/// [`TerrainQuery::globe_heights`]; the positions are checked.
pub(super) fn grounds(
    gpu: &Gpu,
    program: &Program,
    globe: &Globe<f32>,
    positions: &[WorldPos],
    footprint: f32,
) -> Result<Vec<GlobeGround<f32>>, Error> {
    if positions.is_empty() {
        return Ok(Vec::new());
    }
    let buffer = uniform(gpu, &globe.block(WorldPos::default(), 0.0));
    let mut rows = Vec::with_capacity(positions.len() * 48);
    for position in positions {
        let place = globe.place(*position);
        cells(&mut rows, place.cell);
        words(&mut rows, [footprint]);
        words(&mut rows, place.frac);
        words(&mut rows, [0.0]);
        words(&mut rows, place.up);
        words(&mut rows, [0.0]);
    }
    let data = run(gpu, program, &buffer, &rows, [48, 32])?;
    Ok(data
        .chunks_exact(32)
        .map(|row| GlobeGround {
            slope: three(row, 0),
            height: number(row, 12),
            lost: number(row, 16),
        })
        .collect())
}

/// The program that follows rays over a ball.
pub(super) fn program(
    gpu: &Gpu,
    programs: &ProgramSet,
    land: &Land,
    path: RayPath,
    steps: u32,
) -> Result<Program, Error> {
    let features: &[&str] = match path {
        RayPath::Fast => &["TERRAIN_FAST"],
        RayPath::Textbook => &[],
    };
    let constants = [
        ("FIELD_KIND", f64::from(land.field.kind.number())),
        ("MAX_MARCHING_STEPS", f64::from(steps)),
    ];
    compute(
        &gpu.device,
        programs,
        "terrain_globe_rays",
        features,
        &constants,
    )
}

/// [`super::ray_hits`] over a ball; the rays are checked.
pub(super) fn hits(
    gpu: &Gpu,
    program: &Program,
    globe: &Globe<f32>,
    rays: &[TerrainRay],
    pixel_angle: f32,
) -> Result<Vec<TerrainHit>, Error> {
    let top = globe.bounds().maximum;
    let mut hits = vec![TerrainHit::MISS; rays.len()];
    // Those that come below the highest ground: index, start, and what lies before it.
    let mut followed: Vec<(usize, WorldPos, f64)> = Vec::new();
    for (i, ray) in rays.iter().enumerate() {
        let h = globe.altitude(ray.origin);
        let radius = globe.radius() + h;
        let foot = globe.foot(ray.origin);
        let mu = (0..3).map(|k| foot[k] * ray.dir[k]).sum::<f64>() / globe.radius();
        let b = radius * mu;
        let c = (h - top) * (2.0 * globe.radius() + h + top);
        let near = if c <= 0.0 {
            0.0
        } else {
            let root = b * b - c;
            if root < 0.0 || b >= 0.0 {
                continue;
            }
            // The smaller root of the quadratic without a difference.
            c / (root.sqrt() - b)
        };
        if near < ray.far {
            let start = ray.origin.moved_by(ray.dir.map(|d| d * near).into());
            followed.push((i, start, near));
        }
    }
    let nearest = followed.iter().map(|f| f.2).fold(f64::INFINITY, f64::min);
    let nearest = nearest.min(1e9) * f64::from(pixel_angle);
    let buffer = uniform(gpu, &globe.block(WorldPos::default(), nearest));
    let mut rows = Vec::with_capacity(followed.len() * 80);
    for (i, start, near) in &followed {
        let ray = &rays[*i];
        let place = globe.place(*start);
        cells(&mut rows, place.cell);
        words(&mut rows, [*near as f32]);
        words(&mut rows, place.frac);
        words(
            &mut rows,
            [(ray.far - near).min(TerrainRay::FARTHEST_OVER_BALL) as f32],
        );
        words(&mut rows, place.up);
        words(&mut rows, [globe.altitude(*start) as f32]);
        words(&mut rows, ray.dir.map(|c| c as f32));
        words(&mut rows, [pixel_angle]);
    }
    let data = if followed.is_empty() {
        Vec::new()
    } else {
        run(gpu, program, &buffer, &rows, [64, 32])?
    };
    for ((i, _, near), row) in followed.iter().zip(data.chunks_exact(32)) {
        let distance = f64::from(number(row, 12));
        let capped = i32::from_le_bytes([row[20], row[21], row[22], row[23]]) < 0;
        hits[*i] = if distance < 0.0 {
            TerrainHit {
                capped,
                ..TerrainHit::MISS
            }
        } else {
            TerrainHit {
                distance: near + distance,
                normal: three(row, 0).map(f64::from),
                height: f64::from(number(row, 16)),
                capped,
            }
        };
    }
    Ok(hits)
}
