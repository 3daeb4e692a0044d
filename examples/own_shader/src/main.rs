//! A stranger's crate: its build composed `shaders/hills.sp`, and this runs it.

use veduta::device::Gpu;
use veduta::program::PipelineOptions;
use veduta::wgpu;

mod programs {
    include!(concat!(env!("OUT_DIR"), "/veduta_programs.rs"));
}

const SAMPLES: u32 = 256 * 256;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The composed program: plain WGSL, and what it binds.
    let program = programs::programs().get("hills", &[])?;
    for stage in program.stages.iter() {
        println!(
            "{:?} stage: {} bytes of WGSL",
            stage.stage,
            stage.wgsl.len()
        );
    }
    for b in program.bindings.iter() {
        println!(
            "group {} binding {}: {} {:?}",
            b.group, b.binding, b.name, b.ty
        );
    }

    // Its pipeline, with everything else as in any wgpu program.
    let gpu = pollster::block_on(Gpu::open())?;
    let ready = program.pipeline(&gpu.device, &PipelineOptions::default())?;
    let pipeline = ready.compute().ok_or("hills has a compute stage")?;
    let heights = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("heights"),
        size: u64::from(4 * SAMPLES),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("heights"),
        layout: &ready.bind_group_layouts[0],
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: heights.as_entire_binding(),
        }],
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(SAMPLES / 64, 1, 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);

    let bytes = gpu.read_buffer(&heights, heights.size())?;
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for word in bytes.chunks_exact(4) {
        let height = f32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        (low, high) = (low.min(height), high.max(height));
    }
    println!("heights from {low:.3} m to {high:.3} m");
    Ok(())
}
