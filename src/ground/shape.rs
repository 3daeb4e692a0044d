//! Shapes and smoothing of a new ground, on the device.

use super::scene::Shape;
use crate::device::Gpu;
use crate::error::Error;
use crate::exchange::{bind_groups, compute};
use crate::program::ProgramSet;

/// What is done to the heights of a field.
pub(super) struct Form {
    /// Cells along x and z.
    pub size: [usize; 2],
    /// The shape, and its height (m).
    pub shape: Shape,
    pub relief: f64,
    /// Added everywhere (m).
    pub altitude: f64,
    /// Passes of smoothing.
    pub smooth: u32,
    /// Whether the ground goes on at the other edge.
    pub wraps: bool,
}

impl Form {
    /// The uniform block of a pass that adds `offset`.
    fn block(&self, offset: f64) -> Vec<u8> {
        let shape = match self.shape {
            Shape::Even => 0,
            Shape::Hill => 1,
            Shape::Lake => 2,
            Shape::Valley => 3,
            Shape::Ridge => 4,
            Shape::Slope => 5,
            Shape::Bed => 6,
        };
        let [columns, rows] = self.size.map(|n| n as i32);
        let mut block: Vec<u8> = [columns, rows, shape, i32::from(self.wraps)]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        for value in [self.relief, offset, 0.0, 0.0] {
            block.extend((value as f32).to_le_bytes());
        }
        block
    }

    /// Heights (m), by rows, after shape, smoothing and altitude. Submits and waits.
    pub(super) fn applied(
        &self,
        gpu: &Gpu,
        programs: &ProgramSet,
        heights: &[f32],
    ) -> Result<Vec<f32>, Error> {
        use wgpu::BufferUsages as Usage;
        let (device, queue) = (&gpu.device, &gpu.queue);
        let bytes: Vec<u8> = heights.iter().flat_map(|h| h.to_le_bytes()).collect();
        let limits = device.limits();
        let available = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        if bytes.len() as u64 > available {
            return Err(Error::MissingLimit {
                name: "max_storage_buffer_binding_size",
                needed: bytes.len() as u64,
                available,
            });
        }
        let buffer = |size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("veduta ground shape"),
                size: size as u64,
                usage: usage | Usage::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let planes = [(); 2].map(|()| buffer(bytes.len(), Usage::STORAGE | Usage::COPY_SRC));
        queue.write_buffer(&planes[0], 0, &bytes);
        // The altitude comes last: near 0 less is rounded.
        let last = self.smooth;
        let blocks = [0.0, self.altitude].map(|offset| {
            let block = self.block(offset);
            let held = buffer(block.len(), Usage::UNIFORM);
            queue.write_buffer(&held, 0, &block);
            held
        });
        let passes = [
            compute(device, programs, "ground_shape", &[], &[])?,
            compute(device, programs, "ground_smooth", &[], &[])?,
        ];
        let [columns, rows] = self.size.map(|n| n as u32);
        let mut encoder = device.create_command_encoder(&Default::default());
        for k in 0..=last {
            let (pipeline, layouts) = &passes[usize::from(k > 0)];
            let (from, to) = (&planes[k as usize % 2], &planes[(k as usize + 1) % 2]);
            let block = &blocks[usize::from(k == last)];
            let groups = bind_groups(
                device,
                "veduta ground shape",
                layouts,
                &[
                    &[(0, block.as_entire_binding())],
                    &[(0, from.as_entire_binding())],
                    &[(0, to.as_entire_binding())],
                ],
            );
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(pipeline);
                for (group, index) in groups.iter().zip(0..) {
                    pass.set_bind_group(index, group, &[]);
                }
                pass.dispatch_workgroups(columns.div_ceil(64), rows, 1);
            }
            // Long series in parts, as devices bound the time of a submission.
            if k % 16 == 15 {
                queue.submit([encoder.finish()]);
                encoder = device.create_command_encoder(&Default::default());
            }
        }
        queue.submit([encoder.finish()]);
        let found = gpu.read_buffer(&planes[(last as usize + 1) % 2], bytes.len() as u64)?;
        Ok(found
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect())
    }
}
