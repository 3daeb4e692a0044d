//! Windows on a layer whose field does not repeat: squares about the eye, each twice as wide as the one before, in one texture, baked where the eye uncovers them.

use glam::Vec3;

use super::order_table::Source;
use super::tile::ahead_of;
use super::{CloudDeck, CloudQuality, fault};
use crate::error::Error;
use crate::exchange::compute;
use crate::landscape::Work;
use crate::program::ProgramSet;
use crate::programs::blocks::CloudWindows as WindowsBlock;
use crate::programs::blocks::WindowPart as PartBlock;
use crate::settings::Preset;
use crate::view::WorldPos;

/// Windows at most.
const MOST: u32 = 7;
/// Texels that a window moves by at once.
const STEP: i64 = 4;
/// How far from the middle of its window the eye goes before the window follows, in texels; more than half of [`STEP`], so that an eye that goes to and fro bakes nothing.
const SLACK: i64 = 4;
/// Texels at the rim of a window that are not shown, for an eye out of its middle and the half texel that filtering takes.
const MARGIN: f64 = SLACK as f64 + 2.0;
/// Rows of a part of a whole window, and of a strip along z.
const ROWS: u32 = 16;
const STRIP_ROWS: u32 = 64;
/// Frames that a window's edge takes to its place when it comes back after a jump.
const GROWTH: f64 = 16.0;
/// A part of a window takes a stretch of this much of the uniform buffer (bytes).
const STRIDE: u64 = 256;

/// Horizontal way per metre of height of the rays of a sun that is taken to be at least so high, and their whole way.
pub(super) fn slant([x, y, z]: [f32; 3], lowest: f32) -> ([f32; 2], f32) {
    let rise = y.max(lowest);
    let across = (x * x + z * z).sqrt();
    // The same length whatever the rise.
    let level = (1.0 - rise * rise).max(0.0).sqrt() / across.max(1e-12);
    ([x * level / rise, z * level / rise], 1.0 / rise)
}

/// How finely windows about the eye are baked, which take a tile's place for a layer that does not repeat near enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowQuality {
    /// Texels of the edge of each window, a multiple of 32 in [64, 512].
    pub texels: u32,
    /// Levels of each window, in [2, 128].
    pub levels: u32,
    /// Texels of the finest window for each wavelength of the layer, in [1, 1024], while `most` is not reached. There are as many windows as it takes from there to
    /// [`CloudsOptions::far`](super::CloudsOptions::far), each with texels twice as wide.
    pub fineness: u32,
    /// Windows at most, in [1, 7]: where more would be needed texels are up to twice as wide, and then rays end with the widest.
    pub most: u32,
}

impl WindowQuality {
    /// That of a preset: `low`, `medium` and the rest.
    pub fn of(preset: &Preset) -> WindowQuality {
        let (texels, levels, fineness) = match preset {
            Preset::Low => (160, 16, 32),
            Preset::Medium => (320, 24, 48),
            _ => (512, 32, 88),
        };
        WindowQuality {
            texels,
            levels,
            fineness,
            most: if *preset == Preset::Low { 5 } else { 4 },
        }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        if !(64..=512).contains(&self.texels) || !self.texels.is_multiple_of(32) {
            let domain = "a multiple of 32 in [64, 512]";
            return Err(fault("quality.windows.texels", self.texels, domain));
        }
        for (name, value, low, high) in [
            ("levels", self.levels, 2, 128),
            ("fineness", self.fineness, 1, 1024),
            ("most", self.most, 1, MOST),
        ] {
            if !(low..=high).contains(&value) {
                let domain = format!("in [{low}, {high}]");
                return Err(fault(&format!("quality.windows.{name}"), value, &domain));
            }
        }
        Ok(())
    }
}

/// What a window holds.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// Its lowest texel along x and z, counted from the origin.
    corner: [i64; 2],
    /// Rows that are baked: all but after a jump.
    rows: u32,
    /// How far it is shown (m).
    shown: f64,
}

/// Windows that are being baked anew for a sun that has moved, from the widest on.
#[derive(Debug, Clone, Copy)]
struct Turning {
    to_sun: Vec3,
    /// The first window that is done.
    turned: usize,
    /// The corner of the next, and its rows that are done.
    corner: [i64; 2],
    rows: u32,
}

#[derive(Debug)]
pub(super) struct Windows {
    texels: u32,
    levels: u32,
    /// Bytes of a texel.
    texel: u32,
    pub least: f32,
    /// Parts of the period that a texel of the finest window takes, of 2^32.
    turn: u64,
    /// The period in 2^-20 m, as lattices count.
    period: i128,
    frames: u32,
    texture: wgpu::Texture,
    pub view: wgpu::TextureView,
    pub sampler: wgpu::Sampler,
    pipeline: wgpu::ComputePipeline,
    parts: wgpu::Buffer,
    groups: Vec<wgpu::BindGroup>,
    target: wgpu::BindGroup,
    staging: wgpu::Buffer,
    /// What the march reads.
    pub uniform: wgpu::Buffer,
    held: Vec<u8>,
    windows: Vec<Window>,
    /// The sun that they were baked for; none before the first frame.
    sun: Option<Vec3>,
    turning: Option<Turning>,
    /// The place in the stack of the first window.
    first: usize,
    last_sun: Option<Vec3>,
    /// What the cells of light of all orders were last filled from: the corner of their window, and its sun; none while it is begun anew.
    lit_from: Option<([i64; 2], Vec3)>,
    /// The window that they lie over.
    lit: usize,
    /// Parts that this frame has baked, and columns that it may bake yet.
    used: usize,
    budget: i64,
}

/// A place among the texels of the finest window: whole ones from the origin, and the rest.
#[derive(Debug, Clone, Copy)]
struct Place {
    cell: [i64; 2],
    frac: [f64; 2],
}

impl Place {
    /// The same among those of a window that is wider by so many doublings.
    fn over(&self, window: usize) -> Place {
        let part = |k: usize| {
            let below = self.cell[k] & ((1 << window) - 1);
            (below as f64 + self.frac[k]) / f64::from(1_u32 << window)
        };
        Place {
            cell: self.cell.map(|c| c >> window),
            frac: [part(0), part(1)],
        }
    }
}

/// How many windows there are, and the turns of a texel of the finest, for rays that end at a distance.
fn sizes(deck: &CloudDeck, quality: &WindowQuality, far: f64) -> (u32, u64) {
    let WindowQuality {
        texels,
        levels,
        fineness,
        most,
    } = *quality;
    let rise = f64::from(deck.lowest_window_sun(levels));
    let across = 0.5 * deck.thickness * (1.0 / (rise * rise) - 1.0).max(0.0).sqrt();
    let held = 1.0 - 2.0 * MARGIN / f64::from(texels);
    let finest = f64::from(texels) * deck.wavelength / f64::from(fineness);
    // Texels are twice as wide as asked for before anything is left out.
    let widest = (2.0 * (far + across) / held).min(finest * f64::from(1_u32 << most.min(MOST - 1)));
    let doublings = (widest / finest).log2().ceil();
    let count = doublings.clamp(0.0, f64::from(most - 1)) as u32 + 1;
    let texel = widest / f64::from(1_u32 << (count - 1)) / f64::from(texels);
    let turn = (texel / deck.period() * 2.0_f64.powi(32)).round();
    (count, turn.max(1.0) as u64)
}

impl Windows {
    /// Makes room for windows, for rays that end at `far` (m).
    pub fn new(
        device: &wgpu::Device,
        programs: &ProgramSet,
        deck: &CloudDeck,
        quality: &CloudQuality,
        far: f64,
    ) -> Result<Windows, Error> {
        let CloudQuality { wide, frames, .. } = *quality;
        let WindowQuality { texels, levels, .. } = quality.windows;
        let (count, turn) = sizes(deck, &quality.windows, far);
        let bits: &[&str] = if wide { &["CLOUD_WIDE"] } else { &[] };
        let flags = [deck.flags(), bits].concat();
        let (pipeline, layouts) = compute(device, programs, "cloud_window", &flags, &[])?;
        let texel = if wide { 4 } else { 2 };
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("veduta cloud windows"),
            size: wgpu::Extent3d {
                width: texels,
                height: texels,
                depth_or_array_layers: levels * (count + 1),
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: if wide {
                wgpu::TextureFormat::Rg16Float
            } else {
                wgpu::TextureFormat::Rg8Snorm
            },
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let buffer = |size: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("veduta cloud windows"),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        let whole = row_bytes(texel * texels) * ROWS.max(STEP as u32);
        let strip = row_bytes(texel * STEP as u32) * STRIP_ROWS;
        let staging = buffer(
            u64::from(whole.max(strip) * levels),
            Usage::STORAGE | Usage::COPY_SRC,
        );
        // The first frame bakes all of them.
        let most = u64::from(count * texels.div_ceil(ROWS));
        let parts = buffer(most * STRIDE, Usage::UNIFORM | Usage::COPY_DST);
        let group = |layout, buffer, offset, size| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("veduta cloud windows"),
                layout,
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer,
                        offset,
                        size: wgpu::BufferSize::new(size),
                    }),
                }],
            })
        };
        Ok(Windows {
            texels,
            levels,
            texel,
            least: if wide { 1.0 } else { deck.least_density() },
            turn,
            period: (deck.period() * UNIT).round() as i128,
            frames,
            view: texture.create_view(&Default::default()),
            texture,
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("veduta cloud windows"),
                address_mode_u: wgpu::AddressMode::Repeat,
                address_mode_v: wgpu::AddressMode::Repeat,
                address_mode_w: wgpu::AddressMode::ClampToEdge,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            groups: (0..most)
                .map(|k| group(&layouts[0], &parts, k * STRIDE, PartBlock::SIZE as u64))
                .collect(),
            target: group(&layouts[2], &staging, 0, staging.size()),
            pipeline,
            parts,
            staging,
            uniform: buffer(WindowsBlock::SIZE as u64, Usage::UNIFORM | Usage::COPY_DST),
            held: Vec::new(),
            windows: vec![
                Window {
                    corner: [0; 2],
                    rows: 0,
                    shown: 0.0,
                };
                count as usize
            ],
            sun: None,
            turning: None,
            first: 0,
            last_sun: None,
            lit_from: None,
            lit: lit_window(deck, texels, count, turn),
            used: 0,
            budget: 0,
        })
    }

    /// Forgets how the sun went on: what it went while nothing was shown is no step.
    pub fn forget_step(&mut self) {
        self.last_sun = None;
    }

    pub fn count(&self) -> usize {
        self.windows.len()
    }

    pub fn texture_bytes(&self) -> u64 {
        let columns = u64::from(self.texels) * u64::from(self.texels);
        columns * u64::from(self.texel * self.levels) * (self.count() as u64 + 1)
    }

    pub fn buffer_bytes(&self) -> u64 {
        self.staging.size() + self.parts.size() + self.uniform.size()
    }

    /// Bind groups, beside that of the march.
    pub fn bind_groups(&self) -> u32 {
        self.groups.len() as u32 + 1
    }

    /// Edge of a texel of a window (m).
    fn texel_size(&self, window: usize) -> f64 {
        let turns = self.turn << window;
        turns as f64 * self.period as f64 / UNIT / 2.0_f64.powi(32)
    }

    /// How far a window that keeps up with the eye is shown (m).
    fn half(&self, window: usize) -> f64 {
        (f64::from(self.texels / 2) - MARGIN) * self.texel_size(window)
    }

    /// The sun that most windows were baked for.
    pub fn sun(&self) -> Option<Vec3> {
        self.sun
    }

    /// Where a position lies among the texels of the finest window: exact at any distance.
    fn place(&self, eye: WorldPos) -> Place {
        let p = eye.normalized();
        let mut place = Place {
            cell: [0; 2],
            frac: [0.0; 2],
        };
        for (k, axis) in [(0, 0), (1, 2)] {
            let fraction = f64::from(p.frac[axis]) * UNIT;
            let position = (i128::from(p.cell[axis]) << 20) + fraction.floor() as i128;
            // A texel is turn / 2^32 of the period.
            let texel = i128::from(self.turn) * self.period;
            let scaled = position << 32;
            let rest = scaled.rem_euclid(texel) as f64 + fraction.fract() * 2.0_f64.powi(32);
            place.cell[k] = scaled.div_euclid(texel) as i64;
            place.frac[k] = (rest / texel as f64).min(1.0 - f64::EPSILON);
        }
        place
    }

    /// The corner of a window with the eye in its middle.
    fn corner_about(&self, at: Place) -> [i64; 2] {
        at.cell
            .map(|c| (c - i64::from(self.texels / 2) + STEP / 2).div_euclid(STEP) * STEP)
    }

    /// The place in the stack of a window that is or will be baked for the next sun, or is for the last.
    fn slot(&self, window: usize, next: bool) -> usize {
        (self.first + window + usize::from(next)) % (self.count() + 1)
    }

    /// Whether a window has been baked for the next sun.
    fn is_turned(&self, window: usize) -> bool {
        self.turning.is_some_and(|t| window >= t.turned)
    }

    /// What cells of light of all orders are filled from.
    pub fn lit_source(&self) -> Source<'_> {
        let edge = f64::from(self.texels) * self.texel_size(self.lit);
        Source {
            views: std::slice::from_ref(&self.view),
            sampler: &self.sampler,
            levels: self.levels,
            least: self.least,
            window: Some((edge, self.count() as u32 + 1)),
        }
    }

    /// What has become of the window that so many cells of light of all orders lie over since they were last asked for.
    pub fn lit(&mut self, cells: u32) -> Lit {
        let window = self.windows[self.lit];
        let turned = self.is_turned(self.lit);
        let next = self.turning.filter(|_| turned).map(|t| t.to_sun);
        let sun = next.or(self.sun).unwrap_or(Vec3::Y);
        let mut lit = Lit {
            slot: self.slot(self.lit, turned),
            sun,
            fresh: false,
            moved: false,
        };
        if window.rows < self.texels {
            // Until there is something to see the cells keep what they have.
            self.lit_from = None;
            return lit;
        }
        let cell = i64::from(self.texels / cells).max(1);
        match self.lit_from {
            None => lit.fresh = true,
            Some((corner, from)) => {
                let off = |a: usize| (window.corner[a] - corner[a]).abs();
                lit.moved = off(0) >= cell || off(1) >= cell || from != sun;
            }
        }
        if lit.fresh || lit.moved {
            self.lit_from = Some((window.corner, sun));
        }
        lit
    }

    /// Brings the windows up to the eye and the sun, and tells the march of them. Returns whether all were begun anew.
    pub fn advance(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        deck: &CloudDeck,
        eye: WorldPos,
        to_sun: Option<Vec3>,
        work: &mut Work,
    ) -> bool {
        let place = self.place(eye);
        if to_sun.is_none() {
            self.last_sun = None;
        }
        let day = to_sun.is_some();
        let to_sun = to_sun.or(self.sun).unwrap_or(Vec3::Y);
        let step = self.last_sun.map_or(Vec3::ZERO, |last| to_sun - last);
        self.last_sun = day.then_some(to_sun);
        let columns = i64::from(self.texels) * i64::from(self.texels);
        self.used = 0;
        self.budget = (columns * self.count() as i64 / (2 * i64::from(self.frames)))
            .max(2 * STEP * i64::from(self.texels));
        let mut baker = Baker {
            queue,
            encoder,
            deck,
            work,
        };
        let sun = self.sun.filter(|sun| (to_sun - *sun).length() < 0.17);
        // What is being baked for a sun that has not come.
        self.turning = self
            .turning
            .filter(|t| t.turned < self.windows.len() || (to_sun - t.to_sun).length() < 0.17);
        let fresh = sun.is_none();
        if fresh {
            // The first frame, or a sun that has jumped.
            (self.sun, self.turning) = (Some(to_sun), None);
            self.lit_from = None;
            for k in (0..self.count()).rev() {
                let corner = self.corner_about(place.over(k));
                baker.work.bakes += 1;
                self.whole(&mut baker, k, corner, [0, self.texels], None);
                self.windows[k] = Window {
                    corner,
                    rows: self.texels,
                    shown: self.half(k),
                };
            }
        } else {
            for k in (0..self.count()).rev() {
                self.follow(&mut baker, k, place.over(k));
            }
            self.complete(&mut baker);
            self.turn(&mut baker, place, to_sun, step);
        }
        self.tell(queue, deck, place, work);
        fresh
    }

    /// Moves a window after the eye, or begins it anew where little of it would stay.
    fn follow(&mut self, baker: &mut Baker<'_>, k: usize, at: Place) {
        let far = i64::from(self.texels / 2);
        // How far the eye is from the middle.
        let off = |w: &Window, axis: usize| at.cell[axis] - far - w.corner[axis];
        if [0, 1]
            .iter()
            .any(|a| off(&self.windows[k], *a).abs() >= far)
        {
            self.windows[k] = Window {
                corner: self.corner_about(at),
                rows: 0,
                shown: 0.0,
            };
            baker.work.bakes += 1;
            return;
        }
        if self.windows[k].rows < self.texels {
            return;
        }
        for axis in [0, 1] {
            while self.budget > 0 {
                let away = off(&self.windows[k], axis);
                if (-SLACK..SLACK).contains(&away) {
                    break;
                }
                let ahead = away > 0;
                if !self.strip(baker, k, axis, ahead) {
                    return;
                }
            }
        }
    }

    /// Moves a window by a strip along an axis; false where no room is left for its parts.
    fn strip(&mut self, baker: &mut Baker<'_>, k: usize, axis: usize, ahead: bool) -> bool {
        let n = self.texels;
        let heights = if axis == 0 { n.div_ceil(STRIP_ROWS) } else { 1 };
        if self.used + heights as usize > self.groups.len() {
            return false;
        }
        let mut corner = self.windows[k].corner;
        let uncovered = if ahead {
            corner[axis] + i64::from(n)
        } else {
            corner[axis] - STEP
        };
        corner[axis] += if ahead { STEP } else { -STEP };
        let texel = uncovered.rem_euclid(i64::from(n)) as u32;
        if axis == 0 {
            for z in (0..n).step_by(STRIP_ROWS as usize) {
                let rows = STRIP_ROWS.min(n - z);
                self.bake(baker, k, corner, [texel, z], [STEP as u32, rows], None);
            }
        } else {
            self.bake(baker, k, corner, [0, texel], [n, STEP as u32], None);
        }
        self.windows[k].corner = corner;
        baker.work.bakes += 1;
        true
    }

    /// Goes on with windows that have been begun anew, the widest first; the widest of all at once.
    fn complete(&mut self, baker: &mut Baker<'_>) {
        let last = self.count() - 1;
        for k in (0..=last).rev() {
            let window = self.windows[k];
            if window.rows == self.texels {
                continue;
            }
            let rows = if k == last {
                self.texels
            } else {
                self.affordable(window.rows)
            };
            let done = self.whole(baker, k, window.corner, [window.rows, rows], None);
            self.windows[k].rows = done;
            if done == self.texels {
                // The widest has nothing behind it that it could be faded in over.
                self.windows[k].shown = if k == last { self.half(k) } else { 0.0 };
            }
        }
    }

    /// The row up to which this frame may bake.
    fn affordable(&self, done: u32) -> u32 {
        let rows = (self.budget / i64::from(self.texels)).clamp(0, i64::from(self.texels)) as u32;
        (done + rows.next_multiple_of(ROWS)).min(self.texels)
    }

    /// Bakes rows of a window, as far as there is room for their parts; the row up to which it is done.
    fn whole(
        &mut self,
        baker: &mut Baker<'_>,
        k: usize,
        corner: [i64; 2],
        [from, to]: [u32; 2],
        sun: Option<Vec3>,
    ) -> u32 {
        let mut row = from;
        while row < to && self.used < self.groups.len() {
            let rows = ROWS.min(self.texels - row);
            self.bake(baker, k, corner, [0, row], [self.texels, rows], sun);
            row += rows;
        }
        row
    }

    /// Bakes windows anew for a sun that has moved, one after the other.
    fn turn(&mut self, baker: &mut Baker<'_>, place: Place, to_sun: Vec3, step: Vec3) {
        if self.windows.iter().any(|w| w.rows < self.texels) {
            return;
        }
        let Some(sun) = self.sun else { return };
        let mut turning = match self.turning {
            Some(turning) => turning,
            None => {
                // A sun within a tenth of a minute of arc is the same.
                if (to_sun - sun).length() < 3e-5 {
                    return;
                }
                // They are shown for as long as the next round takes: baked for the middle of that time.
                let ahead = ahead_of(to_sun, step, 3.0 * self.frames as f32);
                let last = self.count() - 1;
                baker.work.bakes += 1;
                Turning {
                    to_sun: ahead,
                    turned: self.count(),
                    corner: self.corner_about(place.over(last)),
                    rows: 0,
                }
            }
        };
        self.turning = Some(turning);
        let k = turning.turned - 1;
        let aim = self.corner_about(place.over(k));
        let lost = i64::from(self.texels / 8);
        if [0, 1]
            .iter()
            .any(|a| (aim[*a] - turning.corner[*a]).abs() > lost)
        {
            // The eye has left it behind.
            (turning.corner, turning.rows) = (aim, 0);
        }
        let rows = self.affordable(turning.rows).max(turning.rows + ROWS);
        let rows = rows.min(self.texels);
        let sun = Some(turning.to_sun);
        turning.rows = self.whole(baker, k, turning.corner, [turning.rows, rows], sun);
        if turning.rows == self.texels {
            self.windows[k].corner = turning.corner;
            turning.turned = k;
            turning.rows = 0;
            if k > 0 {
                turning.corner = self.corner_about(place.over(k - 1));
            }
        }
        self.turning = Some(turning);
        if turning.turned == 0 {
            self.first = self.slot(0, true);
            (self.sun, self.turning) = (Some(turning.to_sun), None);
        }
    }

    /// Records the baking of a rectangle of texels of a window; for another sun than its own in the free place of the stack.
    fn bake(
        &mut self,
        baker: &mut Baker<'_>,
        k: usize,
        corner: [i64; 2],
        first: [u32; 2],
        size: [u32; 2],
        sun: Option<Vec3>,
    ) {
        let turned = self.is_turned(k);
        let own = if turned {
            self.turning.map(|t| t.to_sun)
        } else {
            self.sun
        };
        let to_sun = sun.or(own).unwrap_or(Vec3::Y);
        let slot = self.slot(k, turned || sun.is_some());
        let deck = baker.deck;
        let (shear, slant) = slant(to_sun.to_array(), deck.lowest_window_sun(self.levels));
        let shape = deck.shape.clone().unwrap_or_default();
        let n = i64::from(self.texels);
        // Whole turns are none.
        let texel_turn = (self.turn << k) as u32;
        let block = PartBlock {
            shear,
            turn: corner.map(|c| (c as u32).wrapping_mul(texel_turn)),
            corner: corner.map(|c| c.rem_euclid(n) as i32),
            first: first.map(|c| c as i32),
            size: size.map(|c| c as i32),
            texel_turn,
            texels: self.texels as i32,
            slant,
            levels: self.levels as i32,
            turns_per_metre: (1.0 / deck.period()) as f32,
            period_doublings: deck.period_doublings,
            bottom: deck.bottom as f32,
            thickness: deck.thickness as f32,
            coverage: deck.coverage as f32,
            uniformity: deck.uniformity as f32,
            extinction: deck.extinction as f32,
            seed: deck.seed,
            kind: shape.kind as f32,
            kind_spread: shape.kind_spread as f32,
            coverage_spread: shape.coverage_spread as f32,
            detail: shape.detail as f32,
            sharpness: shape.sharpness as f32,
            weather_doublings: shape.weather_doublings,
            least: self.least,
            ..Default::default()
        };
        let bytes = block.to_bytes();
        let at = self.used as u64 * STRIDE;
        baker.queue.write_buffer(&self.parts, at, &bytes);
        {
            let mut pass = baker.encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.groups[self.used], &[]);
            pass.set_bind_group(2, &self.target, &[]);
            let each = size[0] * size[1] * self.texel / 4;
            pass.dispatch_workgroups(each.div_ceil(64), 1, 1);
        }
        baker.encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer: &self.staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes(self.texel * size[0])),
                    rows_per_image: Some(size[1]),
                },
            },
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d {
                    x: first[0],
                    y: first[1],
                    z: slot as u32 * self.levels,
                },
                ..self.texture.as_image_copy()
            },
            wgpu::Extent3d {
                width: size[0],
                height: size[1],
                depth_or_array_layers: self.levels,
            },
        );
        self.used += 1;
        self.budget -= i64::from(size[0]) * i64::from(size[1]);
        baker.work.dispatches += 1;
        baker.work.writes += 1;
        baker.work.bytes += bytes.len() as u64;
    }

    /// Tells the march what there is.
    fn tell(&mut self, queue: &wgpu::Queue, deck: &CloudDeck, place: Place, work: &mut Work) {
        let count = self.count();
        let mut near = [0.0_f64; 8];
        let mut least = 0.0_f64;
        for (k, told) in near.iter_mut().enumerate().take(count) {
            let (size, whole) = (self.texel_size(k), self.half(k));
            let at = place.over(k);
            let window = &mut self.windows[k];
            let held = if window.rows < self.texels {
                0.0
            } else {
                let side = |a: usize| {
                    let from = (at.cell[a] - window.corner[a]) as f64 + at.frac[a] - 0.5;
                    from.min(f64::from(self.texels) - 1.0 - from) * size
                };
                let shown = window.shown;
                window.shown = (shown + whole / GROWTH).min(whole);
                side(0).min(side(1)).min(shown)
            };
            least = least.max(held);
            *told = least;
        }
        near[count..].fill(least);
        let near = near.map(|n| n as f32);
        let widest = place.over(count - 1);
        let edge = f64::from(self.texels);
        let on = |a: usize| {
            let cell = widest.cell[a].rem_euclid(i64::from(self.texels)) as f64;
            ((cell + widest.frac[a]) / edge) as f32
        };
        let lowest = deck.lowest_window_sun(self.levels);
        let sheared = |sun: Vec3| slant(sun.to_array(), lowest).0;
        let sun = self.sun.unwrap_or(Vec3::Y);
        let turning = self.turning.map_or((sun, count), |t| (t.to_sun, t.turned));
        let block = WindowsBlock {
            near: [near[0], near[1], near[2], near[3]],
            wide: [near[4], near[5], near[6], near[7]],
            place: [on(0), on(1)],
            shear: sheared(sun),
            next_shear: sheared(turning.0),
            per_metre: (1.0 / (edge * self.texel_size(count - 1))) as f32,
            count: count as f32,
            first: self.first as f32,
            turned: turning.1 as f32,
            bottom: deck.bottom as f32,
            thickness: deck.thickness as f32,
            levels: self.levels as f32,
            extinction: deck.extinction as f32,
            clear: deck.clear_way() as f32,
            least: self.least,
            lit_scale: f64::from(1_u32 << (count - 1 - self.lit)) as f32,
            lit_near: (0.6 * self.half(self.lit)) as f32,
            lit_wide: (0.85 * self.half(self.lit)) as f32,
            ..Default::default()
        };
        let bytes = block.to_bytes().to_vec();
        if bytes != self.held {
            queue.write_buffer(&self.uniform, 0, &bytes);
            work.writes += 1;
            work.bytes += bytes.len() as u64;
            self.held = bytes;
        }
    }

    /// The distance that rays end at at the farthest (m): what the widest window holds for every sun.
    pub fn reach(&self, deck: &CloudDeck) -> f64 {
        let rise = f64::from(deck.lowest_window_sun(self.levels));
        let across = 0.5 * deck.thickness * (1.0 / (rise * rise) - 1.0).max(0.0).sqrt();
        (self.half(self.count() - 1) - across).max(0.0)
    }
}

/// The window that cells of light of all orders lie over, and what is new of it.
pub(super) struct Lit {
    pub slot: usize,
    /// The sun that it was baked for.
    pub sun: Vec3,
    /// Whether it has been begun anew.
    pub fresh: bool,
    /// Whether it has moved by a cell, or was baked for another sun.
    pub moved: bool,
}

/// The first window that is at least four wavelengths wide, or the last.
fn lit_window(deck: &CloudDeck, texels: u32, count: u32, turn: u64) -> usize {
    let edge = |k: u32| {
        let turns = (turn << k) as f64 * f64::from(texels);
        turns / 2.0_f64.powi(32) * deck.period()
    };
    (0..count - 1)
        .find(|k| edge(*k) >= 4.0 * deck.wavelength)
        .unwrap_or(count - 1) as usize
}

/// What baking needs beside the windows.
struct Baker<'a> {
    queue: &'a wgpu::Queue,
    encoder: &'a mut wgpu::CommandEncoder,
    deck: &'a CloudDeck,
    work: &'a mut Work,
}

/// Parts of a metre that lattices are counted in.
const UNIT: f64 = (1_u64 << 20) as f64;

/// Bytes of a row in the buffer: copies want multiples of 256.
fn row_bytes(bytes: u32) -> u32 {
    bytes.next_multiple_of(256)
}
