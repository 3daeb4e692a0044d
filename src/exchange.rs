//! Compute programs: their pipelines, and rows to them and results back, which every query does.

use crate::error::Error;
use crate::program::{Pipeline, PipelineOptions, ProgramSet, ReadyPipeline};

/// Storage buffers of one query: rows in, results out.
pub(crate) struct Exchange {
    /// What the program reads.
    pub input: wgpu::Buffer,
    /// What it writes.
    pub output: wgpu::Buffer,
}

impl Exchange {
    /// Uploads rows and makes room for `size` bytes of results.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, rows: &[u8], size: usize) -> Exchange {
        use wgpu::BufferUsages as Usage;
        let buffer = |label, size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let input = buffer(
            "veduta rows",
            rows.len() as u64,
            Usage::STORAGE | Usage::COPY_DST,
        );
        queue.write_buffer(&input, 0, rows);
        let output = buffer(
            "veduta results",
            size as u64,
            Usage::STORAGE | Usage::COPY_SRC,
        );
        Exchange { input, output }
    }

    /// Records the program after what the encoder holds already, submits, waits and reads the results.
    pub fn run(
        self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mut encoder: wgpu::CommandEncoder,
        pipeline: &wgpu::ComputePipeline,
        groups: &[wgpu::BindGroup],
        workgroups: u32,
    ) -> Result<Vec<u8>, Error> {
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("veduta read back"),
            size: self.output.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            for (group, index) in groups.iter().zip(0..) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.dispatch_workgroups(workgroups, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&self.output, 0, &staging, 0, staging.size());
        queue.submit([encoder.finish()]);
        crate::device::read_staging(device, &staging)
    }
}

/// Three numbers of a result, `at` bytes from its start.
pub(crate) fn three(result: &[u8], at: usize) -> [f32; 3] {
    [0, 4, 8].map(|k| {
        let b = &result[at + k..at + k + 4];
        f32::from_le_bytes([b[0], b[1], b[2], b[3]])
    })
}

/// The pipeline of a compute program with its layouts.
pub(crate) fn compute(
    device: &wgpu::Device,
    programs: &ProgramSet,
    name: &str,
    features: &[&str],
    constants: &[(&str, f64)],
) -> Result<(wgpu::ComputePipeline, Vec<wgpu::BindGroupLayout>), Error> {
    let ReadyPipeline {
        pipeline,
        bind_group_layouts,
    } = programs.get(name, features)?.pipeline(
        device,
        &PipelineOptions {
            constants,
            ..Default::default()
        },
    )?;
    match pipeline {
        Pipeline::Compute(pipeline) => Ok((pipeline, bind_group_layouts)),
        Pipeline::Render(_) => Err(Error::MissingStage {
            program: name.to_owned(),
        }),
    }
}

/// What a binding gets.
type Bound<'a> = &'a [(u32, wgpu::BindingResource<'a>)];

/// Bind groups for a program's layouts, from what each group's bindings get.
pub(crate) fn bind_groups(
    device: &wgpu::Device,
    label: &str,
    layouts: &[wgpu::BindGroupLayout],
    bound: &[Bound<'_>],
) -> Vec<wgpu::BindGroup> {
    layouts
        .iter()
        .zip(bound)
        .map(|(layout, resources)| {
            let entries: Vec<wgpu::BindGroupEntry<'_>> = resources
                .iter()
                .map(|(binding, resource)| wgpu::BindGroupEntry {
                    binding: *binding,
                    resource: resource.clone(),
                })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout,
                entries: &entries,
            })
        })
        .collect()
}
