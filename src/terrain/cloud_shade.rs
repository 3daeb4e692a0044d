//! Shadows of clouds on the ground of a plane.

use crate::clouds::{CLEAR, CloudShadow, clear_tile};
use crate::error::Error;

/// What the program `terrain` reads of a layer of clouds.
#[derive(Debug)]
pub(super) struct CloudShade {
    layout: wgpu::BindGroupLayout,
    layer: wgpu::Buffer,
    /// Where there are no clouds: a tile without depth.
    clear: (wgpu::TextureView, wgpu::Sampler),
    /// The tile that is bound; none for the clear one.
    tile: Option<wgpu::TextureView>,
    pub group: wgpu::BindGroup,
    held: [f32; 13],
}

/// Bytes of the fields of `CloudTile`, as they are written.
pub(super) const CLOUD_BYTES: u32 = 4 * CLEAR.len() as u32;

/// Bytes of the uniform that holds them.
pub(super) const CLOUD_BLOCK: u32 = CLOUD_BYTES.next_multiple_of(16);

impl CloudShade {
    /// Without clouds.
    ///
    /// # Errors
    /// [`Error::Device`] where the device gives no memory.
    pub fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> Result<CloudShade, Error> {
        let layer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta cloud shadow"),
            size: u64::from(CLOUD_BLOCK),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: true,
        });
        layer
            .slice(..u64::from(CLOUD_BYTES))
            .get_mapped_range_mut()
            .map_err(|e| Error::Device(e.to_string()))?
            .copy_from_slice(&CLEAR.map(f32::to_le_bytes).concat());
        layer.unmap();
        let clear = (
            clear_tile(device),
            device.create_sampler(&Default::default()),
        );
        Ok(CloudShade {
            group: bound(device, layout, &layer, &clear.0, &clear.1),
            layout: layout.clone(),
            layer,
            clear,
            tile: None,
            held: CLEAR,
        })
    }

    /// Takes the shadow of a frame; the number of writes.
    pub fn set(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        shadow: Option<&CloudShadow<'_>>,
    ) -> u32 {
        let tile = shadow.map(|s| s.tile);
        if tile != self.tile.as_ref() {
            let (view, sampler) =
                shadow.map_or((&self.clear.0, &self.clear.1), |s| (s.tile, s.sampler));
            self.group = bound(device, &self.layout, &self.layer, view, sampler);
            self.tile = tile.cloned();
        }
        let layer = shadow.map_or(CLEAR, |s| s.layer);
        if layer == self.held {
            return 0;
        }
        queue.write_buffer(&self.layer, 0, &layer.map(f32::to_le_bytes).concat());
        self.held = layer;
        1
    }
}

fn bound(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    layer: &wgpu::Buffer,
    tile: &wgpu::TextureView,
    sampler: &wgpu::Sampler,
) -> wgpu::BindGroup {
    super::group(
        device,
        layout,
        &[
            layer.as_entire_binding(),
            wgpu::BindingResource::Sampler(sampler),
            wgpu::BindingResource::TextureView(tile),
        ],
    )
}
