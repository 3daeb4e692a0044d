//! The ground on the device: its planes, its steps, its state back.

use super::options::{Boundary, GroundOptions, Scheme, Spring, within};
use super::state::{CHANNELS, GroundState};
use crate::device::read_staging;
use crate::error::Error;
use crate::exchange::compute;
use crate::landscape::Work;
use crate::program::ProgramSet;

/// Words before the tiles' own in the buffer of tiles, and words of a strip's book.
const CONTROL: usize = 16;
const BOOK: usize = 12;

/// Grounds made so far.
static GROUNDS: std::sync::atomic::AtomicU64 = std::sync::atomic::AtomicU64::new(0);

/// Cells along an edge of a tile.
const TILE: usize = 32;

/// Sums of what happened since the ground was made or its state set. Depths summed over cells (m). Water that [`Tool::Water`] adds or takes is in none of them: who edits keeps that book.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GroundReport {
    /// Rained and sprung up.
    pub gained: f64,
    /// Evaporated.
    pub evaporated: f64,
    /// Seeped away.
    pub seeped: f64,
    /// Run off over open edges.
    pub run_off: f64,
    /// Sediment run off over open edges.
    pub load_run_off: f64,
    /// Seconds simulated.
    pub time: f64,
    /// Steps done.
    pub steps: u32,
    /// Tiles that ran in the last step, of so many.
    pub active_tiles: u32,
    /// All tiles.
    pub tiles: u32,
    /// Tiles that ran in all steps together.
    pub tile_steps: u64,
    /// Length of the last step (s).
    pub last_step: f64,
    /// Least and greatest height that the ground has had (m): within 5e-7 of the heights' parts, never narrower.
    pub heights: [f64; 2],
}

#[derive(Debug)]
struct Pass {
    pipeline: wgpu::ComputePipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
}

impl Pass {
    fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        name: &str,
        features: &[&str],
        constants: &[(&str, f64)],
    ) -> Result<Pass, Error> {
        let (pipeline, layouts) = compute(device, programs, name, features, constants)?;
        Ok(Pass { pipeline, layouts })
    }

    fn group(
        &self,
        device: &wgpu::Device,
        index: usize,
        entries: &[(u32, &wgpu::Buffer)],
    ) -> wgpu::BindGroup {
        let entries: Vec<wgpu::BindGroupEntry> = entries
            .iter()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: *binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("veduta ground"),
            layout: &self.layouts[index],
            entries: &entries,
        })
    }
}

/// A pass with its bind groups for both parities.
#[derive(Debug)]
struct Bound {
    pass: Pass,
    /// The same without rain and springs, where it has them.
    calm: Option<wgpu::ComputePipeline>,
    groups: [Vec<wgpu::BindGroup>; 2],
}

#[derive(Debug)]
struct Tools {
    edit: Pass,
    level: Pass,
}

#[derive(Debug)]
struct Planes {
    water: [wgpu::Buffer; 2],
    ground: wgpu::Buffer,
    x: [wgpu::Buffer; 2],
    z: [wgpu::Buffer; 2],
    means: wgpu::Buffer,
    load: [wgpu::Buffer; 2],
    tiles: wgpu::Buffer,
    arguments: wgpu::Buffer,
    step: wgpu::Buffer,
    springs: wgpu::Buffer,
    extremes: wgpu::Buffer,
}

/// Least and greatest of the heights that strips have noted in their books.
fn extremes_of(books: &[u32]) -> [f32; 2] {
    let books = books.as_chunks::<BOOK>().0.iter();
    books.fold([3e38, -3e38], |[low, high], book| {
        [
            f32::from_bits(book[10]).min(low),
            f32::from_bits(book[11]).max(high),
        ]
    })
}

/// How many cells of the grid a spring wells up in.
fn cells_of(spring: &Spring, columns: usize, rows: usize) -> u32 {
    let within = |middle: f32, size: usize| {
        let end = (middle + spring.radius).floor().min(size as f32 - 1.0) as i32;
        (middle - spring.radius).ceil().max(0.0) as i32..=end
    };
    within(spring.z, rows)
        .flat_map(|z| within(spring.x, columns).map(move |x| [x, z]))
        .filter(|[x, z]| {
            let d = [*x as f32 - spring.x, *z as f32 - spring.z];
            d[0] * d[0] + d[1] * d[1] <= spring.radius * spring.radius
        })
        .count() as u32
}

/// Refuses springs whose water would go nowhere.
fn check_springs(options: &GroundOptions, columns: usize, rows: usize) -> Result<(), Error> {
    for (k, spring) in options.springs.iter().enumerate() {
        if spring.rate > 0.0 && cells_of(spring, columns, rows) == 0 {
            return Err(Error::OutOfDomain {
                name: format!("ground.springs[{k}]"),
                value: format!("{spring:?}"),
                domain: format!("a circle that holds the middle of a cell of {columns} x {rows}"),
            });
        }
    }
    Ok(())
}

/// What an edit does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tool {
    /// Raises the ground by the strength (m), or lowers it if that is negative.
    Raise,
    /// Moves the ground by a share (the strength) towards the mean of the neighbours.
    Smooth,
    /// Adds noise of the strength (m).
    Noise {
        /// Wavelength (cells), in [1, 4096].
        wavelength: f32,
    },
    /// Adds water (m), or takes it away, no more than there is. No sum of [`GroundReport`] counts it.
    Water,
    /// Moves the ground by a share (the strength) towards a height.
    Flatten {
        /// The height (m), in [-1e5, 1e5].
        height: f32,
    },
}

/// A change under a cursor, fading to its edge by (1 - r^2)^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundEdit {
    /// What is done.
    pub tool: Tool,
    /// Column of the cursor, in [-1e5, 1e5]; where the boundary is `Periodic` it reaches over the edges.
    pub x: f32,
    /// Row of the cursor, in the same way.
    pub z: f32,
    /// Radius (cells), in [0, 1e4]; `None`: everywhere, without fading.
    pub radius: Option<f32>,
    /// Metres, in [-1e4, 1e4]; of `Smooth` and `Flatten` a share, in [0, 1].
    pub strength: f32,
    /// Seed of noise.
    pub seed: u32,
}

impl GroundEdit {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] that names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), Error> {
        within("edit.x", self.x, -1e5, 1e5)?;
        within("edit.z", self.z, -1e5, 1e5)?;
        within("edit.radius", self.radius.unwrap_or(0.0), 0.0, 1e4)?;
        let share = matches!(self.tool, Tool::Smooth | Tool::Flatten { .. });
        let [least, most] = if share { [0.0, 1.0] } else { [-1e4, 1e4] };
        within("edit.strength", self.strength, least, most)?;
        match self.tool {
            Tool::Noise { wavelength } => within("edit.wavelength", wavelength, 1.0, 4096.0),
            Tool::Flatten { height } => within("edit.height", height, -1e5, 1e5),
            _ => Ok(()),
        }
    }
}

/// What a query finds at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundPoint {
    /// Height of the ground (m).
    pub height: f32,
    /// Depth of the water (m).
    pub depth: f32,
    /// Velocity along x and z (m/s).
    pub velocity: [f32; 2],
    /// Unit normal of the ground.
    pub normal: [f32; 3],
}

/// A query on its way.
#[derive(Debug)]
pub struct GroundQuery {
    staging: wgpu::Buffer,
    /// Of which ground.
    ground: u64,
    /// Changes that were recorded before it: states and edits.
    state: u64,
    edits: u64,
    mapped: Option<std::sync::mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>>,
}

impl GroundQuery {
    /// The answer in the order of the places, when the device has it; `None` before. Waits for nothing; call it after the submission, each frame.
    ///
    /// # Errors
    /// [`Error::Device`]; [`Error::OutOfDomain`] for another ground than that which was asked: the answer stays for its own.
    pub fn take(
        &mut self,
        device: &wgpu::Device,
        ground: &mut Ground,
    ) -> Result<Option<Vec<GroundPoint>>, Error> {
        if ground.identity != self.ground {
            return Err(Error::OutOfDomain {
                name: "ground.query".to_owned(),
                value: format!("of ground {}", self.ground),
                domain: format!("of the ground that takes it, {}", ground.identity),
            });
        }
        let receiver = self.mapped.get_or_insert_with(|| {
            let (sender, receiver) = std::sync::mpsc::channel();
            self.staging
                .slice(..)
                .map_async(wgpu::MapMode::Read, move |r| {
                    // A closed channel means that nobody wants it.
                    let _ = sender.send(r);
                });
            receiver
        });
        device
            .poll(wgpu::PollType::Poll)
            .map_err(|e| Error::Device(e.to_string()))?;
        match receiver.try_recv() {
            Err(std::sync::mpsc::TryRecvError::Empty) => return Ok(None),
            Err(std::sync::mpsc::TryRecvError::Disconnected) => {
                return Err(Error::Device(
                    "the answer of this query has been taken, or its device is lost".to_owned(),
                ));
            }
            Ok(result) => result.map_err(|e| Error::Device(e.to_string()))?,
        }
        let bytes = self
            .staging
            .slice(..)
            .get_mapped_range()
            .map_err(|e| Error::Device(e.to_string()))?
            .to_vec();
        self.staging.unmap();
        let (points, extremes) = bytes.split_at(bytes.len() - 8);
        let extremes = extremes.as_chunks::<4>().0;
        ground.learn(self, [0, 1].map(|k| f32::from_le_bytes(extremes[k])));
        let points: Vec<GroundPoint> = points
            .as_chunks::<32>()
            .0
            .iter()
            .map(|row| {
                let v = |k: usize| {
                    f32::from_le_bytes([row[4 * k], row[4 * k + 1], row[4 * k + 2], row[4 * k + 3]])
                };
                GroundPoint {
                    height: v(0),
                    depth: v(1),
                    velocity: [v(2), v(3)],
                    normal: [v(4), v(5), v(6)],
                }
            })
            .collect();
        Ok(Some(points))
    }
}

/// A grid of heights with water on the device.
///
/// ```no_run
/// # fn frame(gpu: &veduta::device::Gpu) -> Result<(), veduta::Error> {
/// use veduta::ground::{Ground, GroundOptions, GroundState};
/// let state = GroundState::from_heights(64, 64, &vec![0.0; 64 * 64])?;
/// let options = GroundOptions { rain: 1e-5, ..Default::default() };
/// let mut ground = Ground::new(&gpu.device, &gpu.queue, veduta::programs(), &options, &state)?;
/// let mut encoder = gpu.device.create_command_encoder(&Default::default());
/// let work = ground.step(&mut encoder, 100);
/// gpu.queue.submit([encoder.finish()]);
/// println!("{} dispatches, {} m in the first cell", work.dispatches, ground.state(gpu)?.water(0, 0));
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct Ground {
    /// Which of all that were made.
    identity: u64,
    options: GroundOptions,
    columns: usize,
    rows: usize,
    groups: usize,
    tiles_x: usize,
    tiles: usize,
    reference: f32,
    planes: Planes,
    plan: Bound,
    first: Bound,
    second: Bound,
    level: Option<Bound>,
    parity: usize,
    edit: Tools,
    query: Pass,
    extremes: Pass,
    /// Least and greatest height so far as the device has told.
    known: [f32; 2],
    /// What they may be after each edit since, by its number: each holds those before.
    maybe: Vec<(u64, [f32; 2])>,
    states: u64,
    edits: u64,
    changes: u64,
}

impl Ground {
    /// Makes pipelines and planes, and uploads a state.
    ///
    /// # Errors
    /// As [`GroundOptions::check`] and [`GroundState::from_channels`]; [`Error::MissingLimit`] when a pair of planes does not fit a binding; the faults of
    /// [`ProgramSet::get`] and of making pipelines.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        programs: &ProgramSet,
        options: &GroundOptions,
        state: &GroundState,
    ) -> Result<Ground, Error> {
        options.check()?;
        let (columns, rows) = (state.columns, state.rows);
        check_springs(options, columns, rows)?;
        let groups = columns.div_ceil(4);
        let tiles_x = columns.div_ceil(TILE);
        let tiles = tiles_x * rows.div_ceil(TILE);
        let pair = (2 * 4 * groups * rows * 4) as u64;
        let limits = device.limits();
        let available = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        if pair > available {
            return Err(Error::MissingLimit {
                name: "max_storage_buffer_binding_size",
                needed: pair,
                available,
            });
        }
        use wgpu::BufferUsages as Usage;
        let buffer = |label, size: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | Usage::COPY_DST | Usage::COPY_SRC,
                mapped_at_creation: false,
            })
        };
        let plane = |label| buffer(label, pair, Usage::STORAGE);
        let words = CONTROL + 3 * tiles + tiles * 8 * BOOK;
        let physical = options.scheme == Scheme::Physical;
        let small = |label| buffer(label, 64, Usage::STORAGE);
        let planes = Planes {
            water: [
                plane("veduta water"),
                if physical {
                    plane("veduta water after")
                } else {
                    small("veduta no water")
                },
            ],
            ground: plane("veduta ground"),
            x: [plane("veduta speeds x"), plane("veduta speeds x after")],
            z: [plane("veduta speeds z"), plane("veduta speeds z after")],
            means: plane("veduta mean water"),
            load: [plane("veduta sediment"), plane("veduta change")],
            tiles: buffer("veduta tiles", 4 * words as u64, Usage::STORAGE),
            arguments: buffer("veduta arguments", 16, Usage::STORAGE | Usage::INDIRECT),
            step: buffer("veduta step", 144, Usage::UNIFORM),
            springs: buffer("veduta springs", 64, Usage::UNIFORM),
            extremes: buffer("veduta extremes", 8, Usage::STORAGE),
        };
        let features: &[&str] = if options.erosion.is_some() {
            &["GROUND_EROSION"]
        } else {
            &[]
        };
        let pass = |name| Pass::new(device, programs, name, features, &[]);
        let calm = |name| -> Result<Option<wgpu::ComputePipeline>, Error> {
            let constants = [("GROUND_FRESH", 0.0)];
            Ok(Some(
                Pass::new(device, programs, name, features, &constants)?.pipeline,
            ))
        };
        let p = &planes;
        let plan = pass("ground_plan")?;
        let plan_groups = || {
            vec![
                plan.group(device, 0, &[(0, &p.step)]),
                plan.group(device, 1, &[(0, &p.tiles)]),
                plan.group(device, 2, &[(0, &p.arguments)]),
            ]
        };
        let plan_groups = [plan_groups(), plan_groups()];
        let (first, second, level);
        let eroding = options.erosion.is_some();
        let [load, change] = &p.load;
        if physical {
            let (one, two) = (pass("ground_shallow")?, pass("ground_advance")?);
            let groups_one = [0, 1].map(|k: usize| {
                vec![
                    one.group(device, 0, &[(0, &p.step), (1, &p.springs)]),
                    one.group(
                        device,
                        1,
                        &[
                            (0, &p.water[k]),
                            (1, &p.ground),
                            (2, &p.tiles),
                            (3, &p.x[k]),
                            (4, &p.z[k]),
                        ],
                    ),
                    one.group(device, 2, &[(0, &p.x[1 - k]), (1, &p.z[1 - k])]),
                ]
            });
            let groups_two = [0, 1].map(|k: usize| {
                vec![
                    two.group(device, 0, &[(0, &p.step), (1, &p.springs)]),
                    two.group(
                        device,
                        1,
                        &[(0, &p.water[k]), (1, &p.ground), (2, &p.tiles)],
                    ),
                    two.group(
                        device,
                        2,
                        &[
                            (0, &p.water[1 - k]),
                            (1, &p.x[1 - k]),
                            (2, &p.z[1 - k]),
                            (3, &p.means),
                        ],
                    ),
                ]
            });
            first = Bound {
                pass: one,
                calm: calm("ground_shallow")?,
                groups: groups_one,
            };
            second = Bound {
                pass: two,
                calm: calm("ground_advance")?,
                groups: groups_two,
            };
            level = None;
        } else {
            let (one, two) = (pass("ground_speeds")?, pass("ground_transport")?);
            let groups_one = [0, 1].map(|k: usize| {
                let mut out = vec![(0, &p.x[k]), (1, &p.z[k])];
                if eroding {
                    out.extend([(2, &p.means), (3, load), (4, change)]);
                }
                vec![
                    one.group(device, 0, &[(0, &p.step)]),
                    one.group(
                        device,
                        1,
                        &[(0, &p.water[0]), (1, &p.ground), (2, &p.tiles)],
                    ),
                    one.group(device, 2, &out),
                ]
            });
            let groups_two = [0, 1].map(|k: usize| {
                let mut out = vec![
                    (0, &p.water[0]),
                    (1, &p.x[1 - k]),
                    (2, &p.z[1 - k]),
                    (3, &p.means),
                ];
                if eroding {
                    out.push((4, load));
                }
                vec![
                    two.group(device, 0, &[(0, &p.step), (1, &p.springs)]),
                    two.group(device, 1, &[(0, &p.x[k]), (1, &p.z[k]), (2, &p.tiles)]),
                    two.group(device, 2, &out),
                ]
            });
            level = match eroding {
                true => {
                    let three = pass("ground_level")?;
                    let groups = [0, 1].map(|_| {
                        vec![
                            three.group(device, 0, &[(0, &p.step)]),
                            three.group(device, 1, &[(0, change), (2, &p.tiles)]),
                            three.group(device, 2, &[(0, &p.ground)]),
                        ]
                    });
                    Some(Bound {
                        pass: three,
                        calm: None,
                        groups,
                    })
                }
                false => None,
            };
            first = Bound {
                pass: one,
                calm: None,
                groups: groups_one,
            };
            second = Bound {
                pass: two,
                calm: calm("ground_transport")?,
                groups: groups_two,
            };
        }
        let edit = Tools {
            edit: pass("ground_edit")?,
            level: Pass::new(
                device,
                programs,
                "ground_level",
                &[],
                &[("GROUND_ALL", 1.0)],
            )?,
        };
        let (query, extremes) = (pass("ground_query")?, pass("ground_range")?);
        let mut ground = Ground {
            identity: GROUNDS.fetch_add(1, std::sync::atomic::Ordering::Relaxed),
            options: options.clone(),
            columns,
            rows,
            groups,
            tiles_x,
            tiles,
            reference: 0.0,
            planes,
            plan: Bound {
                pass: plan,
                calm: None,
                groups: plan_groups,
            },
            first,
            second,
            level,
            parity: 0,
            edit,
            query,
            extremes,
            known: [0.0; 2],
            maybe: Vec::new(),
            states: 0,
            edits: 0,
            changes: 0,
        };
        ground.set_state(queue, state)?;
        Ok(ground)
    }

    /// What it obeys.
    pub fn options(&self) -> &GroundOptions {
        &self.options
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let p = &self.planes;
        let all = [
            &p.water[0],
            &p.water[1],
            &p.ground,
            &p.means,
            &p.tiles,
            &p.arguments,
            &p.step,
            &p.springs,
            &p.extremes,
        ];
        let mut bytes: u64 = all.iter().map(|b| b.size()).sum();
        bytes +=
            p.x.iter()
                .chain(&p.z)
                .chain(&p.load)
                .map(wgpu::Buffer::size)
                .sum::<u64>();
        bytes
    }

    /// Changes weather, step and coefficients; scheme, and whether there is erosion, must stay. Written by the queue: it holds from the next submission on, also for steps that were recorded before
    /// and are not submitted yet (see [`Ground::step`]).
    ///
    /// # Errors
    /// As [`GroundOptions::check`]; [`Error::OutOfDomain`] for another scheme, for erosion that comes or goes, and for springs that reach no cell. The ground stays as it is then.
    pub fn set_options(
        &mut self,
        queue: &wgpu::Queue,
        options: &GroundOptions,
    ) -> Result<(), Error> {
        options.check()?;
        check_springs(options, self.columns, self.rows)?;
        if options.scheme != self.options.scheme
            || options.erosion.is_some() != self.options.erosion.is_some()
        {
            return Err(Error::OutOfDomain {
                name: "ground.scheme".to_owned(),
                value: format!("{:?}", options.scheme),
                domain: "that which it was made with, as whether there is erosion".to_owned(),
            });
        }
        self.options = options.clone();
        self.changes += 1;
        self.upload(queue);
        self.wake(queue);
        Ok(())
    }

    /// Floats a plane: rows of whole vectors.
    fn plane(&self) -> usize {
        4 * self.groups * self.rows
    }

    /// Where a cell is in a plane: tile after tile, rows of a tile one after the other, so that memory is read in the order in which it lies. The last tiles are as narrow as the grid.
    fn place_of(&self, x: usize, z: usize) -> usize {
        let [above, before] = [z, x].map(|n| n / TILE * TILE);
        let wide = 4 * self.groups;
        let tile = above * wide + before * TILE.min(self.rows - above);
        tile + (z - above) * TILE.min(wide - before) + (x - before)
    }

    fn wake(&self, queue: &wgpu::Queue) {
        let flags: Vec<u8> = std::iter::repeat_n(1_u32.to_le_bytes(), self.tiles)
            .flatten()
            .collect();
        queue.write_buffer(&self.planes.tiles, 4 * CONTROL as u64, &flags);
    }

    fn upload(&self, queue: &wgpu::Queue) {
        let o = &self.options;
        let e = o.erosion.unwrap_or_default();
        let whole = [
            self.columns as i32,
            self.rows as i32,
            self.groups as i32,
            self.tiles_x as i32,
            self.tiles as i32,
            match o.boundary {
                Boundary::Open => 0,
                Boundary::Closed => 1,
                Boundary::Periodic => 2,
            },
            i32::from(o.scheme == Scheme::Physical),
            i32::from(o.rain > 0.0),
        ];
        let mut block: Vec<u8> = whole.iter().flat_map(|v| v.to_le_bytes()).collect();
        for value in [
            o.step,
            o.damping,
            f32::from(u8::from(o.momentum)),
            o.rain,
            o.evaporation,
            o.seepage,
            o.mean_weight,
            o.gravity,
            o.spacing,
            o.courant,
            o.friction,
            o.longest_step,
            e.capacity,
            e.deepest,
            e.dig,
            e.lay,
            e.slope_limit * o.spacing,
            e.slide,
            e.hardness,
            e.hard_wavelength,
            e.layer,
            self.reference,
        ] {
            block.extend(value.to_le_bytes());
        }
        block.extend((o.springs.len() as i32).to_le_bytes());
        block.extend(0_u32.to_le_bytes());
        queue.write_buffer(&self.planes.step, 0, &block);
        let mut springs = Vec::with_capacity(64);
        for k in 0..4 {
            let row = o.springs.get(k).map_or([0.0; 4], |s| {
                let cells = cells_of(s, self.columns, self.rows);
                let area = cells.max(1) as f32 * o.spacing * o.spacing;
                [s.x, s.z, s.radius, s.rate / area]
            });
            springs.extend(row.iter().flat_map(|v| v.to_le_bytes()));
        }
        queue.write_buffer(&self.planes.springs, 0, &springs);
    }

    /// Uploads a state of the same size; clock and sums begin anew. Heights on the device count from a level that follows from the least and greatest base alone, and which stays until another state
    /// is set: what digging and edits do to the ground does not move it, so that a state which is saved and set again goes on bit for bit.
    ///
    /// Written by the queue, before all that is submitted later: submit what was recorded for the state before it first (see [`Ground::step`]).
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for another size, and as [`GroundState::from_channels`].
    pub fn set_state(&mut self, queue: &wgpu::Queue, state: &GroundState) -> Result<(), Error> {
        let checked =
            GroundState::from_channels(state.columns, state.rows, CHANNELS, &state.cells)?;
        if [state.columns, state.rows] != [self.columns, self.rows] {
            return Err(Error::OutOfDomain {
                name: "ground.state".to_owned(),
                value: format!("{} x {}", state.columns, state.rows),
                domain: format!("{} x {}", self.columns, self.rows),
            });
        }
        let physical = self.options.scheme == Scheme::Physical;
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for c in checked.cells.chunks_exact(CHANNELS) {
            low = low.min(c[0]);
            high = high.max(c[0]);
        }
        // Of the bases, which nothing changes: a state that is saved and set again counts from the same.
        self.reference = 0.0_f32.clamp(low, high).round();
        // Of a state of the source's scheme all are 0, though it moves; of this one where it moves they are not.
        let given = state.has_discharges
            && (checked.cells.chunks_exact(CHANNELS)).any(|c| c[12] != 0.0 || c[13] != 0.0);
        let plane = self.plane();
        let pair = |first: &dyn Fn(usize, usize) -> f32, second: &dyn Fn(usize, usize) -> f32| {
            let mut numbers = vec![0.0_f32; 2 * plane];
            for z in 0..self.rows {
                for x in 0..self.columns {
                    let at = self.place_of(x, z);
                    numbers[at] = first(x, z);
                    numbers[plane + at] = second(x, z);
                }
            }
            numbers
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect::<Vec<u8>>()
        };
        let at = |x: usize, z: usize, k: usize| checked.cell(x, z)[k];
        let p = &self.planes;
        let send = |buffer: &wgpu::Buffer, bytes: &[u8]| queue.write_buffer(buffer, 0, bytes);
        let water = pair(&|x, z| at(x, z, 1), &|x, z| at(x, z, 10));
        send(&p.water[0], &water);
        if physical {
            send(&p.water[1], &water);
        }
        send(
            &p.ground,
            &pair(
                &|x, z| (at(x, z, 0) - self.reference) + at(x, z, 8),
                &|x, z| at(x, z, 0),
            ),
        );
        // The faster of each cell's own faces, to +x and +z.
        let mut faces = vec![0.0_f32; self.columns * self.rows];
        let mean = |x, z| at(x, z, 3);
        send(&p.means, &pair(&mean, &|_, _| 0.0));
        if physical {
            let wraps = self.options.boundary == Boundary::Periodic;
            let level = |x, z| (at(x, z, 0) - self.reference) + at(x, z, 8);
            // A face's speed: what this cell sends over it less what the next one does.
            let face = |x: usize, z: usize, along_z: bool| {
                let (n, size) = if along_z {
                    (z + 1, self.rows)
                } else {
                    (x + 1, self.columns)
                };
                if n == size && !wraps {
                    return (0.0, 0.0);
                }
                let n = n % size;
                let (fx, fz) = if along_z { (x, n) } else { (n, z) };
                let (out, back) = if along_z { (5, 7) } else { (4, 6) };
                let speed = at(x, z, out) - at(fx, fz, back);
                let rise = level(fx, fz) - level(x, z);
                let near = (at(x, z, 1) - rise.max(0.0)).max(0.0);
                let far = (at(fx, fz, 1) - (-rise).max(0.0)).max(0.0);
                let q = if given {
                    at(x, z, if along_z { 13 } else { 12 })
                } else {
                    speed.max(0.0) * near + speed.min(0.0) * far
                };
                (speed, q)
            };
            send(
                &p.x[0],
                &pair(&|x, z| face(x, z, false).0, &|x, z| face(x, z, false).1),
            );
            send(
                &p.z[0],
                &pair(&|x, z| face(x, z, true).0, &|x, z| face(x, z, true).1),
            );
            for (k, fastest) in faces.iter_mut().enumerate() {
                let (x, z) = (k % self.columns, k / self.columns);
                *fastest = face(x, z, false).0.abs().max(face(x, z, true).0.abs());
            }
        } else {
            send(&p.x[0], &pair(&|x, z| at(x, z, 4), &|x, z| at(x, z, 6)));
            send(&p.z[0], &pair(&|x, z| at(x, z, 5), &|x, z| at(x, z, 7)));
        }
        {
            let [load, change] = &p.load;
            send(load, &pair(&|x, z| at(x, z, 2), &|x, z| at(x, z, 11)));
            send(change, &pair(&|x, z| at(x, z, 8), &|x, z| at(x, z, 9)));
        }
        // As a step finds it: of the source's scheme nothing asks for it.
        let fastest = faces
            .iter()
            .zip(checked.cells.chunks_exact(CHANNELS))
            .map(|(face, c)| face.abs() + (self.options.gravity * c[1]).max(0.0).sqrt())
            .fold(0.0, f32::max);
        let mut words = vec![0_u32; p.tiles.size() as usize / 4];
        words[CONTROL + self.tiles..CONTROL + 2 * self.tiles].fill(fastest.to_bits());
        // What each strip has had, as `ground_level` notes it.
        let books = CONTROL + 3 * self.tiles;
        for book in words[books..].as_chunks_mut::<BOOK>().0 {
            [book[10], book[11]] = [3e38_f32.to_bits(), (-3e38_f32).to_bits()];
        }
        for z in 0..self.rows {
            for x in 0..self.columns {
                let (base, more) = (at(x, z, 0) - self.reference, at(x, z, 8));
                let (height, slack) = (base + more, 2.4e-7 * (base.abs() + more.abs()));
                let tile = z / TILE * self.tiles_x + x / TILE;
                let book = books + (8 * tile + x % TILE / 4) * BOOK;
                let least = f32::from_bits(words[book + 10]).min(height - slack);
                let most = f32::from_bits(words[book + 11]).max(height + slack);
                [words[book + 10], words[book + 11]] = [least.to_bits(), most.to_bits()];
            }
        }
        let extremes = extremes_of(&words[books..]);
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        queue.write_buffer(&p.tiles, 0, &bytes);
        self.parity = 0;
        self.changes += 1;
        self.states += 1;
        self.known = self.over(extremes);
        self.maybe.clear();
        self.upload(queue);
        self.wake(queue);
        Ok(())
    }

    /// Records steps; nothing where nothing moves.
    ///
    /// Steps and edits act when their encoder is submitted, and the ground counts them when they are recorded: submit every encoder, in the order in which they were recorded, before
    /// [`Ground::state`], [`Ground::report`], [`Ground::set_state`] or [`Ground::set_options`], which act on the queue at once. An encoder that is dropped leaves the ground a step behind what it believes;
    /// set its state then.
    pub fn step(&mut self, encoder: &mut wgpu::CommandEncoder, steps: u32) -> Work {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("veduta ground"),
            timestamp_writes: None,
        });
        let mut work = Work::default();
        self.changes += u64::from(steps);
        for _ in 0..steps {
            for (bound, indirect) in [
                (Some(&self.plan), false),
                (Some(&self.first), true),
                (Some(&self.second), true),
                (self.level.as_ref(), true),
            ] {
                let Some(bound) = bound else { continue };
                let pipeline = match &bound.calm {
                    Some(calm) if self.options.rain == 0.0 && self.options.springs.is_empty() => {
                        calm
                    }
                    _ => &bound.pass.pipeline,
                };
                pass.set_pipeline(pipeline);
                for (group, index) in bound.groups[self.parity].iter().zip(0..) {
                    pass.set_bind_group(index, group, &[]);
                }
                if indirect {
                    pass.dispatch_workgroups_indirect(&self.planes.arguments, 0);
                } else {
                    pass.dispatch_workgroups(1, 1, 1);
                }
                work.dispatches += 1;
            }
            self.parity = 1 - self.parity;
        }
        work
    }

    fn water_now(&self) -> &wgpu::Buffer {
        match self.options.scheme {
            Scheme::Source => &self.planes.water[0],
            Scheme::Physical => &self.planes.water[self.parity],
        }
    }

    /// What a picture reads: the block of the step, ground, water and its mean.
    pub(super) fn shown(&self) -> [&wgpu::Buffer; 4] {
        let p = &self.planes;
        [&p.step, &p.ground, self.water_now(), &p.means]
    }

    /// Height from which the planes count (m), and how often what they hold may have changed.
    pub(super) fn shown_as(&self) -> (f32, u64) {
        (self.reference, self.changes)
    }

    /// Cells along x and z.
    pub fn size(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// Records a change of the ground or its water, which wakes the tiles that it reaches. Several may wait in one submission, between steps.
    ///
    /// # Errors
    /// As [`GroundEdit::check`].
    pub fn edit(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        edit: &GroundEdit,
    ) -> Result<Work, Error> {
        edit.check()?;
        self.changes += 1;
        let (number, height, wavelength) = match edit.tool {
            Tool::Raise => (0_i32, 0.0, 1.0),
            Tool::Smooth => (1, 0.0, 1.0),
            Tool::Noise { wavelength } => (2, 0.0, wavelength),
            Tool::Water => (3, 0.0, 1.0),
            Tool::Flatten { height } => (4, height - self.reference, 1.0),
        };
        let mut block = Vec::with_capacity(32);
        for value in [edit.x, edit.z, edit.radius.unwrap_or(-1.0), edit.strength] {
            block.extend(value.to_le_bytes());
        }
        block.extend(number.to_le_bytes());
        block.extend(
            [height, wavelength]
                .iter()
                .flat_map(|v: &f32| v.to_le_bytes()),
        );
        block.extend(edit.seed.to_le_bytes());
        // Of its own, so that several edits may wait in one submission.
        let tool = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta tool"),
            size: block.len() as u64,
            usage: wgpu::BufferUsages::UNIFORM,
            mapped_at_creation: true,
        });
        tool.slice(..)
            .get_mapped_range_mut()
            .map_err(|e| Error::Device(e.to_string()))?
            .copy_from_slice(&block);
        tool.unmap();
        let (p, t) = (&self.planes, &self.edit);
        let sets = [
            (
                &t.edit,
                [
                    t.edit.group(device, 0, &[(0, &p.step), (1, &tool)]),
                    t.edit.group(device, 1, &[(0, &p.ground), (1, &p.tiles)]),
                    t.edit
                        .group(device, 2, &[(0, &p.load[1]), (1, self.water_now())]),
                ],
            ),
            (
                &t.level,
                [
                    t.level.group(device, 0, &[(0, &p.step)]),
                    t.level.group(device, 1, &[(0, &p.load[1]), (2, &p.tiles)]),
                    t.level.group(device, 2, &[(0, &p.ground)]),
                ],
            ),
        ];
        let workgroups = [
            [(self.groups as u32).div_ceil(64), self.rows as u32],
            [self.tiles as u32, 1],
        ];
        // Water leaves the ground as it is.
        let count = if edit.tool == Tool::Water { 1 } else { 2 };
        let mut pass = encoder.begin_compute_pass(&Default::default());
        for ((tool, groups), [x, y]) in sets.iter().zip(workgroups).take(count) {
            pass.set_pipeline(&tool.pipeline);
            for (group, index) in groups.iter().zip(0..) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.dispatch_workgroups(x, y, 1);
        }
        drop(pass);
        if self.options.scheme == Scheme::Physical && edit.tool == Tool::Water {
            let size = p.water[0].size();
            encoder.copy_buffer_to_buffer(
                &p.water[self.parity],
                0,
                &p.water[1 - self.parity],
                0,
                size,
            );
        }
        let [low, high] = self.range();
        let most = edit.strength.abs();
        let maybe = match edit.tool {
            Tool::Raise => [low + edit.strength.min(0.0), high + edit.strength.max(0.0)],
            Tool::Noise { .. } => [low - most, high + most],
            Tool::Flatten { height } => [low.min(height), high.max(height)],
            Tool::Smooth | Tool::Water => [low, high],
        };
        self.edits += 1;
        if self.maybe.len() >= 64 {
            // The later ones hold it.
            let _ = self.maybe.remove(0);
        }
        // Sums of floats, rounded outwards.
        self.maybe.push((
            self.edits,
            [
                maybe[0].next_down().next_down(),
                maybe[1].next_up().next_up(),
            ],
        ));
        Ok(Work {
            dispatches: count as u32,
            writes: 1,
            bytes: 32,
            ..Default::default()
        })
    }

    /// Least and greatest height that the ground has had since its state was set (m), never narrower than the ground itself was then: as the device found it where the last answer that was taken
    /// ([`Ground::query`], [`Ground::query_range`]) was recorded, widened by what edits since may have done. What steps have dug, laid down or let slide since then is not in it.
    pub fn range(&self) -> [f32; 2] {
        let [low, high] = self.known;
        self.maybe
            .last()
            .map_or([low, high], |(_, [a, b])| [low.min(*a), high.max(*b)])
    }

    /// Takes what the device has found for a query.
    fn learn(&mut self, query: &GroundQuery, extremes: [f32; 2]) {
        if query.state != self.states {
            return;
        }
        let [low, high] = self.over(extremes);
        self.known = [self.known[0].min(low), self.known[1].max(high)];
        self.maybe.retain(|(edit, _)| *edit > query.edits);
    }

    /// Extremes over the reference level as heights, rounded outwards.
    fn over(&self, [low, high]: [f32; 2]) -> [f32; 2] {
        let exact = [low, high].map(|v| f64::from(v) + f64::from(self.reference));
        let [a, b] = exact.map(|v| v as f32);
        [
            if f64::from(a) > exact[0] {
                a.next_down()
            } else {
                a
            },
            if f64::from(b) < exact[1] {
                b.next_up()
            } else {
                b
            },
        ]
    }

    /// Records a query of nothing but the least and greatest height so far: once its answer (no points) is taken, [`Ground::range`] has them.
    pub fn query_range(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) -> GroundQuery {
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta ground range"),
            size: 8,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        self.record_range(device, encoder, &staging, 0);
        GroundQuery {
            staging,
            ground: self.identity,
            state: self.states,
            edits: self.edits,
            mapped: None,
        }
    }

    fn record_range(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        staging: &wgpu::Buffer,
        at: u64,
    ) {
        let (p, e) = (&self.planes, &self.extremes);
        let groups = [
            e.group(device, 0, &[(0, &p.step)]),
            e.group(device, 1, &[(0, &p.tiles)]),
            e.group(device, 2, &[(0, &p.extremes)]),
        ];
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&e.pipeline);
            for (group, index) in groups.iter().zip(0..) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.dispatch_workgroups(1, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&p.extremes, 0, staging, at, 8);
    }

    /// Records a query at places in columns and rows (fractions between cells; beyond the edges those of the edge, or of the other edge where the boundary is `Periodic`), and of the least and greatest
    /// height. After the submission [`GroundQuery::take`] has the answer when the device has.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for no places, more than 65,536, and places that are not finite.
    pub fn query(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        places: &[[f32; 2]],
    ) -> Result<GroundQuery, Error> {
        if places.is_empty()
            || places.len() > 65_536
            || places.iter().flatten().any(|v| !v.is_finite())
        {
            return Err(Error::OutOfDomain {
                name: "ground.places".to_owned(),
                value: format!("{} of them", places.len()),
                domain: "1 to 65536 places of finite numbers".to_owned(),
            });
        }
        use wgpu::BufferUsages as Usage;
        let bytes: Vec<u8> = places
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let buffer = |size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("veduta ground query"),
                size: size as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let rows = buffer(bytes.len(), Usage::STORAGE | Usage::COPY_DST);
        queue.write_buffer(&rows, 0, &bytes);
        let found = buffer(32 * places.len(), Usage::STORAGE | Usage::COPY_SRC);
        let staging = buffer(32 * places.len() + 8, Usage::COPY_DST | Usage::MAP_READ);
        let (p, q) = (&self.planes, &self.query);
        let groups = [
            q.group(device, 0, &[(0, &p.step)]),
            q.group(
                device,
                1,
                &[
                    (0, &p.ground),
                    (1, self.water_now()),
                    (2, &p.x[self.parity]),
                    (3, &p.z[self.parity]),
                    (4, &rows),
                ],
            ),
            q.group(device, 2, &[(0, &found)]),
        ];
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&q.pipeline);
            for (group, index) in groups.iter().zip(0..) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.dispatch_workgroups((places.len() as u32).div_ceil(64), 1, 1);
        }
        encoder.copy_buffer_to_buffer(&found, 0, &staging, 0, found.size());
        self.record_range(device, encoder, &staging, found.size());
        Ok(GroundQuery {
            staging,
            ground: self.identity,
            state: self.states,
            edits: self.edits,
            mapped: None,
        })
    }

    fn read(
        &self,
        gpu: &crate::device::Gpu,
        buffers: &[&wgpu::Buffer],
    ) -> Result<Vec<Vec<u8>>, Error> {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let staged: Vec<wgpu::Buffer> = buffers
            .iter()
            .map(|from| {
                let to = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("veduta read back"),
                    size: from.size(),
                    usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                    mapped_at_creation: false,
                });
                encoder.copy_buffer_to_buffer(from, 0, &to, 0, from.size());
                to
            })
            .collect();
        gpu.queue.submit([encoder.finish()]);
        staged
            .iter()
            .map(|s| read_staging(&gpu.device, s))
            .collect()
    }

    /// The state, bit for bit, of what has been submitted: steps and edits that are only recorded must be submitted first (see [`Ground::step`]). Submits and waits.
    ///
    /// # Errors
    /// [`Error::Device`].
    pub fn state(&self, gpu: &crate::device::Gpu) -> Result<GroundState, Error> {
        let physical = self.options.scheme == Scheme::Physical;
        let p = &self.planes;
        let water = if physical {
            &p.water[self.parity]
        } else {
            &p.water[0]
        };
        let [load, change] = &p.load;
        let wanted = [
            water,
            &p.x[self.parity],
            &p.z[self.parity],
            &p.means,
            &p.ground,
            load,
            change,
        ];
        let planes: Vec<Vec<f32>> = self
            .read(gpu, &wanted)?
            .iter()
            .map(|bytes| {
                bytes
                    .as_chunks::<4>()
                    .0
                    .iter()
                    .map(|b| f32::from_le_bytes(*b))
                    .collect()
            })
            .collect();
        let second = self.plane();
        let mut cells = vec![0.0; self.columns * self.rows * CHANNELS];
        for z in 0..self.rows {
            for x in 0..self.columns {
                let at = self.place_of(x, z);
                let cell = (z * self.columns + x) * CHANNELS;
                let c = &mut cells[cell..cell + CHANNELS];
                c[0] = planes[4][second + at];
                c[1] = planes[0][at];
                c[10] = planes[0][second + at];
                c[3] = planes[3][at];
                c[2] = planes[5][at];
                c[11] = planes[5][second + at];
                c[8] = planes[6][at];
                c[9] = planes[6][second + at];
                if physical {
                    let wraps = self.options.boundary == Boundary::Periodic;
                    let left = if x > 0 {
                        planes[1][self.place_of(x - 1, z)]
                    } else if wraps {
                        planes[1][self.place_of(self.columns - 1, z)]
                    } else {
                        0.0
                    };
                    let low = if z > 0 {
                        planes[2][self.place_of(x, z - 1)]
                    } else if wraps {
                        planes[2][self.place_of(x, self.rows - 1)]
                    } else {
                        0.0
                    };
                    c[4] = planes[1][at].max(0.0);
                    c[5] = planes[2][at].max(0.0);
                    c[6] = (-left).max(0.0);
                    c[7] = (-low).max(0.0);
                    c[12] = planes[1][second + at];
                    c[13] = planes[2][second + at];
                } else {
                    c[4] = planes[1][at];
                    c[6] = planes[1][second + at];
                    c[5] = planes[2][at];
                    c[7] = planes[2][second + at];
                }
            }
        }
        Ok(GroundState {
            columns: self.columns,
            rows: self.rows,
            cells,
            has_discharges: physical,
        })
    }

    /// What happened since the state was set, of what has been submitted. Submits and waits.
    ///
    /// # Errors
    /// [`Error::Device`].
    pub fn report(&self, gpu: &crate::device::Gpu) -> Result<GroundReport, Error> {
        let bytes = self.read(gpu, &[&self.planes.tiles])?;
        let words: Vec<u32> = bytes[0]
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| u32::from_le_bytes(*b))
            .collect();
        let real = |k: usize| f64::from(f32::from_bits(words[k]));
        let mut sums = [0.0; 5];
        for book in 0..8 * self.tiles {
            let at = CONTROL + 3 * self.tiles + book * BOOK;
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum += real(at + 2 * k) + real(at + 2 * k + 1);
            }
        }
        Ok(GroundReport {
            gained: sums[0],
            evaporated: sums[1],
            seeped: sums[2],
            run_off: sums[3],
            load_run_off: sums[4],
            time: real(2) + real(3),
            steps: words[4],
            active_tiles: words[0],
            tiles: self.tiles as u32,
            tile_steps: u64::from(words[7]) << 32 | u64::from(words[6]),
            last_step: real(1),
            heights: extremes_of(&words[CONTROL + 3 * self.tiles..])
                .map(|v| f64::from(v) + f64::from(self.reference)),
        })
    }
}
