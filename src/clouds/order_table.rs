//! The table of light that was scattered before, which `Clouds` reads beside its tile: solved by sweeps over the cells of a period, in shares of frames.

use super::layer_orders::{block_of, held, ways};
use super::tile::slant;
use super::volume::{Kernel, dispatch, groups, room};
use super::{CloudDeck, fault};
use crate::error::Error;
use crate::exchange::compute;
use crate::landscape::Work;
use crate::program::ProgramSet;
use crate::programs::blocks::CloudGrid as GridBlock;
use crate::programs::blocks::CloudWeights as WeightsBlock;

/// What lights the cells: the sun; a radiance from above; one from below.
const KINDS: usize = 3;
/// Sweeps of the coarse grid before the first frame: of the sun's light, and of that from around.
const FIRST_SWEEPS: [u32; KINDS] = [20, 8, 8];
/// Sweeps of the fine grid until the light stands.
const SWEEPS: [u32; KINDS] = [24, 16, 16];
/// Sweeps after a sun that has gone on.
const NEXT_SWEEPS: u32 = 12;
/// Bytes of a level in the buffer of means: copies want multiples of 256.
const MEAN_ROW: u32 = 256;
/// Frames that a sweep takes, and one more for what cells scatter of it.
const SHARES: u32 = 4;
/// Frames that a new tile takes to fill the cells.
const FILLS: u32 = 8;
const DIRECTIONS: u32 = 24;
/// How far texels go in a frame to what the cells have found, and for how many frames after it was found: what is left then is 0.4 %.
const EASE: f32 = 0.17;
const SETTLING: u32 = 30;

/// What cells are filled from: tiles, or a window in a stack.
pub(super) struct Source<'a> {
    pub views: &'a [wgpu::TextureView],
    pub sampler: &'a wgpu::Sampler,
    pub levels: u32,
    pub least: f32,
    /// Edge of the window (m) and places in the stack.
    pub window: Option<(f64, u32)>,
}

/// The mean of the cells of each level, for what lies beyond a window.
#[derive(Debug)]
struct Mean {
    kernel: Kernel,
    groups: Vec<wgpu::BindGroup>,
    staging: wgpu::Buffer,
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

/// Light of one kind in the cells of a grid.
#[derive(Debug)]
struct Kind {
    uniform: wgpu::Buffer,
    /// What cells scatter into each direction.
    source: wgpu::Buffer,
    moments: wgpu::Buffer,
    /// Those of the sweep before.
    last: wgpu::Buffer,
    sweep: Vec<wgpu::BindGroup>,
    gather: Vec<wgpu::BindGroup>,
    /// From the coarse grid to the fine one.
    prolong: Vec<wgpu::BindGroup>,
}

#[derive(Debug)]
struct Grid {
    shape: [i32; 3],
    uniform: wgpu::Buffer,
    /// Extinction and light of each cell.
    cells: wgpu::Buffer,
    /// By tile.
    fill: Vec<Vec<wgpu::BindGroup>>,
    kinds: Vec<Kind>,
    bytes: u64,
    buffers: u32,
    groups: u32,
}

impl Grid {
    fn count(&self) -> u32 {
        self.shape.iter().product::<i32>() as u32
    }
}

/// The table, with what makes it.
#[derive(Debug)]
pub(super) struct OrderTable {
    block: GridBlock,
    fill: Kernel,
    sweep: Kernel,
    gather: Kernel,
    prolong: Kernel,
    publish: Kernel,
    grids: [Grid; 2],
    publishing: Vec<wgpu::BindGroup>,
    mean: Option<Mean>,
    staging: wgpu::Buffer,
    texture: wgpu::Texture,
    pub view: wgpu::TextureView,
    /// Weights of the sun's own light by angle.
    pub weights: wgpu::Buffer,
    /// Share of the extinction that is left without the peak.
    pub kept: f32,
    /// The source of an even radiance of 1.
    even: f32,
    /// Sine of the lowest sun.
    lowest: f32,
    /// Gain and momentum of the sun's light.
    pace: (f32, f32),
    /// Parts of the fine cells that are filled from the tile that is shown.
    filled: u32,
    /// Sweeps to go, by kind.
    left: [u32; KINDS],
    /// Which kind is being swept, and how many of its shares are done.
    at: (usize, u32),
    /// Frames until texels have gone on to what the cells have found.
    settling: u32,
    /// Whether cells are to be filled anew when they are full.
    again: bool,
}

impl OrderTable {
    /// Makes room for a table of so many cells along an edge and the height.
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        deck: &CloudDeck,
        tile: &Source<'_>,
        [edge, levels]: [u32; 2],
    ) -> Result<OrderTable, Error> {
        let (mut block, lobes) = block_of(deck, tile.levels, tile.least);
        if let Some((edge, slots)) = tile.window {
            (block.size, block.slots) = (edge as f32, slots as f32);
        }
        let kernel = |flags: &[&str]| {
            let flags: Vec<&str> = [&["CLOUD_LAYERED"], flags].concat();
            compute(device, programs, "cloud_volume", &flags, &[])
        };
        let fill = match tile.window {
            Some(_) => kernel(&["CLOUD_CELLS", "CLOUD_WINDOW"])?,
            None => kernel(&["CLOUD_CELLS"])?,
        };
        let sweep = kernel(&["CLOUD_SWEEP"])?;
        let gather = kernel(&["CLOUD_GATHER"])?;
        let prolong = kernel(&["CLOUD_GATHER", "CLOUD_PROLONG"])?;
        let publish = kernel(&["CLOUD_PUBLISH"])?;
        use wgpu::BufferUsages as Usage;
        let uniform = || room(device, GridBlock::SIZE, Usage::UNIFORM | Usage::COPY_DST);
        let filled = |bytes: &[u8]| -> Result<wgpu::Buffer, Error> {
            let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("veduta cloud orders"),
                size: bytes.len() as u64,
                usage: Usage::UNIFORM,
                mapped_at_creation: true,
            });
            buffer
                .get_mapped_range_mut(..)
                .map_err(|e| Error::Device(e.to_string()))?
                .copy_from_slice(bytes);
            buffer.unmap();
            Ok(buffer)
        };
        let grid = |shape: [u32; 3], coarser: Option<&Grid>| -> Result<Grid, Error> {
            let count = shape.iter().product::<u32>() as usize;
            let storage = |size| room(device, size, Usage::STORAGE | Usage::COPY_DST);
            let own = uniform();
            let cells = storage(8 * count);
            let radiance = storage(4 * 24 * count);
            let faces = storage(4 * 24 * 2 * (shape[0] * shape[0]) as usize);
            let ways = filled(&ways(
                block.size,
                deck.thickness,
                shape[0] as usize,
                shape[1] as usize,
            ))?;
            let head = vec![(0, own.as_entire_binding())];
            let by_tile: Vec<Vec<wgpu::BindGroup>> = tile
                .views
                .iter()
                .map(|view| {
                    let seen = vec![
                        (0, wgpu::BindingResource::Sampler(tile.sampler)),
                        (1, wgpu::BindingResource::TextureView(view)),
                    ];
                    groups(device, &fill, &[head.clone(), seen, held(&[(1, &cells)])])
                })
                .collect();
            let lasts = [storage(64 * count), storage(64 * count)];
            let kinds: Vec<Kind> = (0..KINDS)
                .map(|kind| {
                    let uniform = uniform();
                    let source = storage(4 * 24 * count);
                    let moments = storage(64 * count);
                    // What is summed order by order writes its own and reads none.
                    let last = if kind == 0 { &lasts[0] } else { &lasts[1] };
                    let head = vec![
                        (0, uniform.as_entire_binding()),
                        (1, ways.as_entire_binding()),
                    ];
                    let gathered = |kernel: &Kernel, place: u32, from: &wgpu::Buffer| {
                        let read = held(&[(3, &cells), (place, from)]);
                        let written = held(&[(3, &source), (4, &moments), (8, last)]);
                        groups(device, kernel, &[head.clone(), read, written])
                    };
                    let read = held(&[(3, &cells), (4, &source)]);
                    let written = held(&[(2, &radiance), (6, &faces)]);
                    Kind {
                        sweep: groups(device, &sweep, &[head.clone(), read, written]),
                        gather: gathered(&gather, 5, &radiance),
                        prolong: coarser.map_or_else(Vec::new, |coarse| {
                            gathered(&prolong, 6, &coarse.kinds[kind].moments)
                        }),
                        uniform,
                        source,
                        moments,
                        last: last.clone(),
                    }
                })
                .collect();
            Ok(Grid {
                shape: shape.map(|n| n as i32),
                bytes: (GridBlock::SIZE * (1 + KINDS)) as u64
                    + ways.size()
                    + faces.size()
                    + count as u64 * (8 + 96 + 128 + 160 * KINDS as u64),
                buffers: 7 + 3 * KINDS as u32,
                groups: 3
                    * (by_tile.len() + kinds.len() * (2 + usize::from(coarser.is_some()))) as u32,
                uniform: own,
                cells,
                fill: by_tile,
                kinds,
            })
        };
        let coarse = grid([edge / 2, (levels / 2).max(1), edge / 2], None)?;
        let fine = grid([edge, levels, edge], Some(&coarse))?;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("veduta cloud orders"),
            size: wgpu::Extent3d {
                width: edge,
                height: edge,
                depth_or_array_layers: levels,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let staging = room(
            device,
            (8 * edge * edge * levels) as usize,
            Usage::STORAGE | Usage::COPY_SRC,
        );
        let [sun, above, below] = [0, 1, 2].map(|k: usize| &fine.kinds[k]);
        let publishing = groups(
            device,
            &publish,
            &[
                vec![(0, sun.uniform.as_entire_binding())],
                held(&[
                    (9, &sun.moments),
                    (10, &above.moments),
                    (11, &below.moments),
                ]),
                held(&[(7, &staging)]),
            ],
        );
        let mean = if tile.window.is_some() {
            let kernel = kernel(&["CLOUD_PUBLISH", "CLOUD_WINDOW"])?;
            let staging = room(
                device,
                (MEAN_ROW * levels) as usize,
                Usage::STORAGE | Usage::COPY_SRC,
            );
            let read = held(&[
                (3, &fine.cells),
                (9, &sun.moments),
                (10, &above.moments),
                (11, &below.moments),
            ]);
            let head = vec![(0, sun.uniform.as_entire_binding())];
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("veduta cloud orders, means"),
                size: wgpu::Extent3d {
                    width: 1,
                    height: 1,
                    depth_or_array_layers: levels,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format: wgpu::TextureFormat::Rgba16Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            });
            Some(Mean {
                groups: groups(device, &kernel, &[head, read, held(&[(7, &staging)])]),
                view: texture.create_view(&Default::default()),
                kernel,
                staging,
                texture,
            })
        } else {
            None
        };
        let weights = WeightsBlock {
            pairs: lobes.sun_weights(),
        };
        let kept = 1.0 - lobes.albedo * lobes.peak();
        Ok(OrderTable {
            even: block.degrees[0],
            lowest: match tile.window {
                Some(_) => deck.lowest_window_sun(tile.levels),
                None => deck.lowest_sun(tile.levels),
            },
            pace: lobes.pace(),
            kept: kept as f32,
            weights: filled(&weights.to_bytes())?,
            view: texture.create_view(&Default::default()),
            texture,
            staging,
            publishing,
            mean,
            grids: [coarse, fine],
            block,
            fill,
            sweep,
            gather,
            prolong,
            publish,
            filled: 0,
            left: [0; KINDS],
            at: (0, 0),
            settling: 0,
            again: false,
        })
    }

    /// The mean of the cells of each level, of a table over a window.
    pub fn mean_view(&self) -> Option<&wgpu::TextureView> {
        self.mean.as_ref().map(|mean| &mean.view)
    }

    /// Tells where in the stack the window lies now.
    pub fn set_slot(&mut self, slot: usize) {
        self.block.slot = slot as f32;
    }

    /// Fills the cells anew and goes on from the light that they have, of all kinds: for a window that has moved.
    pub fn renew(&mut self) {
        self.again = true;
    }

    /// Bytes in textures and in buffers, buffers, bind groups.
    pub fn holds(&self) -> (u64, u64, u32, u32) {
        let grids = &self.grids;
        let mean = self.mean.as_ref().map_or(0, |mean| mean.staging.size());
        let more = u32::from(self.mean.is_some());
        (
            self.staging.size() + mean / u64::from(MEAN_ROW) * 8,
            self.staging.size()
                + mean
                + self.weights.size()
                + grids.iter().map(|g| g.bytes).sum::<u64>(),
            2 + more + grids.iter().map(|g| g.buffers).sum::<u32>(),
            3 + 3 * more + grids.iter().map(|g| g.groups).sum::<u32>(),
        )
    }

    /// Brings the table on by a frame's share. `shown` is the tile that is read, `to_sun` what it was baked for; `fresh` begins anew, `swapped` tells of another
    /// tile.
    pub fn advance(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        (shown, to_sun): (usize, [f32; 3]),
        fresh: bool,
        swapped: bool,
        work: &mut Work,
    ) {
        if fresh {
            self.begin(queue, encoder, (shown, to_sun), work);
            return;
        }
        if swapped {
            self.filled = 0;
            self.left[0] = self.left[0].max(NEXT_SWEEPS);
        }
        let mut told = false;
        if self.again && self.filled >= FILLS {
            (self.filled, self.again) = (0, false);
            for (left, sweeps) in self.left.iter_mut().zip(SWEEPS) {
                *left = sweeps.max(*left);
            }
        }
        if self.filled < FILLS {
            let cells = self.grids[1].count();
            let first = self.filled * cells / FILLS;
            let count = (self.filled + 1) * cells / FILLS - first;
            self.fill(queue, encoder, 1, (shown, to_sun), [first, count], work);
            self.filled += 1;
        } else {
            if self.left[self.at.0] == 0 {
                self.turn();
            }
            if self.left[self.at.0] > 0 {
                told = self.at.0 == 0;
                self.share(queue, encoder, to_sun, work);
            }
        }
        if self.settling > 0 {
            self.settling -= 1;
            self.publish(queue, encoder, to_sun, !told, work);
        }
    }

    /// A share of a sweep, or what cells scatter of it.
    fn share(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        to_sun: [f32; 3],
        work: &mut Work,
    ) {
        let (kind, share) = self.at;
        let each = DIRECTIONS.div_ceil(SHARES);
        self.upload(queue, 1, kind, to_sun, share * each, work);
        let grid = &self.grids[1];
        let light = &grid.kinds[kind];
        if share < SHARES {
            dispatch(encoder, &self.sweep, &light.sweep, each as usize);
            work.dispatches += 1;
            self.at.1 += 1;
            return;
        }
        let count = grid.count() as usize;
        dispatch(encoder, &self.gather, &light.gather, count.div_ceil(64));
        work.dispatches += 1;
        self.settling = SETTLING;
        self.left[kind] -= 1;
        self.turn();
    }

    /// Goes on to the kind with the most sweeps to go.
    fn turn(&mut self) {
        let most = (0..KINDS).max_by_key(|k| (self.left[*k], KINDS - k));
        self.at = (most.unwrap_or(0), 0);
    }

    /// All of the coarse grid, and the fine one from it.
    fn begin(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        tile: (usize, [f32; 3]),
        work: &mut Work,
    ) {
        // What is shown first is what is found first.
        self.settling = u32::MAX;
        for grid in [0, 1] {
            let count = self.grids[grid].count();
            self.fill(queue, encoder, grid, tile, [0, count], work);
            for kind in 0..KINDS {
                self.upload(queue, grid, kind, tile.1, 0, work);
            }
        }
        let [coarse, fine] = &self.grids;
        for (kind, sweeps) in FIRST_SWEEPS.into_iter().enumerate() {
            let light = &coarse.kinds[kind];
            let count = coarse.count() as usize;
            // Half of what is around, deep within; none of the sun's.
            let start = if kind == 0 { 0.0 } else { 0.5 * self.even };
            let bytes = start.to_le_bytes().repeat(24 * count);
            queue.write_buffer(&light.source, 0, &bytes);
            encoder.clear_buffer(&light.moments, 0, None);
            encoder.clear_buffer(&light.last, 0, None);
            work.writes += 1;
            work.bytes += bytes.len() as u64;
            for _ in 0..sweeps {
                dispatch(encoder, &self.sweep, &light.sweep, DIRECTIONS as usize);
                dispatch(encoder, &self.gather, &light.gather, count.div_ceil(64));
                work.dispatches += 2;
            }
            let finer = &fine.kinds[kind];
            let count = fine.count() as usize;
            dispatch(encoder, &self.prolong, &finer.prolong, count.div_ceil(64));
            work.dispatches += 1;
        }
        self.filled = FILLS;
        self.left = SWEEPS;
        self.at = (0, 0);
        self.publish(queue, encoder, tile.1, false, work);
        self.settling = 0;
    }

    fn lit(&self, grid: usize, kind: usize, to_sun: [f32; 3], first: u32) -> GridBlock {
        let amount = |k: usize| if kind == k { 1.0 } else { 0.0 };
        // What comes from around is summed order by order: never too much of it.
        let (gain, momentum) = if kind == 0 { self.pace } else { (1.0, 0.0) };
        GridBlock {
            gain,
            momentum,
            to_sun,
            shear: match self.mean {
                Some(_) => super::window::slant(to_sun, self.lowest).0,
                None => slant(to_sun, self.lowest).shear,
            },
            sun: amount(0),
            uniform_light: amount(1),
            below: amount(2),
            cells: self.grids[grid].shape,
            coarse: self.grids[0].shape,
            first: first as i32,
            ease: if self.settling == u32::MAX { 1.0 } else { EASE },
            ..self.block
        }
    }

    fn upload(
        &self,
        queue: &wgpu::Queue,
        grid: usize,
        kind: usize,
        to_sun: [f32; 3],
        first: u32,
        work: &mut Work,
    ) {
        let bytes = self.lit(grid, kind, to_sun, first).to_bytes();
        queue.write_buffer(&self.grids[grid].kinds[kind].uniform, 0, &bytes);
        work.writes += 1;
        work.bytes += bytes.len() as u64;
    }

    fn fill(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        grid: usize,
        (shown, to_sun): (usize, [f32; 3]),
        [first, count]: [u32; 2],
        work: &mut Work,
    ) {
        let bytes = self.lit(grid, 0, to_sun, first).to_bytes();
        let grid = &self.grids[grid];
        queue.write_buffer(&grid.uniform, 0, &bytes);
        dispatch(
            encoder,
            &self.fill,
            &grid.fill[shown],
            (count as usize).div_ceil(64),
        );
        work.writes += 1;
        work.bytes += bytes.len() as u64;
        work.dispatches += 1;
    }

    /// Makes the texture from the cells.
    fn publish(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        to_sun: [f32; 3],
        upload: bool,
        work: &mut Work,
    ) {
        if upload {
            self.upload(queue, 1, 0, to_sun, 0, work);
        }
        let count = self.grids[1].count() as usize;
        dispatch(encoder, &self.publish, &self.publishing, count.div_ceil(64));
        work.dispatches += 1;
        let size = self.texture.size();
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer: &self.staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(8 * size.width),
                    rows_per_image: Some(size.height),
                },
            },
            self.texture.as_image_copy(),
            size,
        );
        if let Some(mean) = &self.mean {
            let size = mean.texture.size();
            let levels = size.depth_or_array_layers as usize;
            dispatch(encoder, &mean.kernel, &mean.groups, levels.div_ceil(64));
            work.dispatches += 1;
            encoder.copy_buffer_to_texture(
                wgpu::TexelCopyBufferInfo {
                    buffer: &mean.staging,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(MEAN_ROW),
                        rows_per_image: Some(1),
                    },
                },
                mean.texture.as_image_copy(),
                size,
            );
        }
    }
}

/// Checks the shape of a table.
pub(super) fn check_cells([edge, levels]: [u32; 2]) -> Result<(), Error> {
    if !(32..=128).contains(&edge) || !edge.is_multiple_of(32) {
        return Err(fault(
            "quality.cells[0]",
            edge,
            "a multiple of 32 in [32, 128]",
        ));
    }
    if !(2..=64).contains(&levels) {
        return Err(fault("quality.cells[1]", levels, "in [2, 64]"));
    }
    Ok(())
}
