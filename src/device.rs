//! Getting a device without a window, for tools, tests and examples.
//!
//! A host application has its own device; nothing else in this crate calls these functions.

use crate::error::Error;

/// A device with its queue and the adapter that they came from.
#[derive(Debug, Clone)]
pub struct Gpu {
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
}

impl Gpu {
    /// Opens the adapter that `wgpu` recommends, honouring `WGPU_BACKEND` and `WGPU_ADAPTER_NAME`.
    ///
    /// The limits are WebGPU's defaults, so that whatever runs here runs in a browser; timestamp queries are turned on
    /// where the adapter has them.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] with the line that installs a software driver, [`Error::Device`] when the device is refused.
    pub async fn open() -> Result<Gpu, Error> {
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let wanted = std::env::var("WGPU_ADAPTER_NAME").ok();
        let adapter = match wanted {
            Some(name) => {
                let adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
                let known: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
                adapters
                    .into_iter()
                    .find(|a| {
                        a.get_info()
                            .name
                            .to_lowercase()
                            .contains(&name.to_lowercase())
                    })
                    .ok_or_else(|| Error::NoAdapter {
                        why: format!(
                            "WGPU_ADAPTER_NAME is `{name}`, but the adapters are {known:?}"
                        ),
                    })?
            }
            None => instance
                .request_adapter(&wgpu::RequestAdapterOptions::default())
                .await
                .map_err(|e| Error::NoAdapter { why: e.to_string() })?,
        };
        let required_features = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("veduta"),
                required_features,
                required_limits: wgpu::Limits::default(),
                ..Default::default()
            })
            .await
            .map_err(|e| Error::Device(e.to_string()))?;
        Ok(Gpu {
            adapter,
            device,
            queue,
        })
    }

    /// Reads a buffer that has `COPY_SRC` usage, blocking until the device has finished.
    ///
    /// # Errors
    /// [`Error::Device`] when the device is lost or the buffer cannot be mapped.
    pub fn read_buffer(&self, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, Error> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: bytes,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes);
        self.queue.submit([encoder.finish()]);
        self.read_staging(&staging)
    }

    /// Reads the first mip level of a 2D texture that has `COPY_SRC` usage, rows packed tightly from the top, blocking
    /// until the device has finished.
    ///
    /// # Errors
    /// [`Error::Device`] when the device is lost, [`Error::OutOfDomain`] for a format without a fixed size of a texel.
    pub fn read_texture(&self, texture: &wgpu::Texture) -> Result<Vec<u8>, Error> {
        let Some(texel) = texture.format().block_copy_size(None) else {
            return Err(Error::OutOfDomain {
                name: "texture.format".to_owned(),
                value: format!("{:?}", texture.format()),
                domain: "a colour format".to_owned(),
            });
        };
        let packed = texture.width() * texel;
        let stride = packed.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(stride) * u64::from(texture.height()),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d {
                depth_or_array_layers: 1,
                ..texture.size()
            },
        );
        self.queue.submit([encoder.finish()]);
        let padded = self.read_staging(&staging)?;
        Ok(padded
            .chunks_exact(stride as usize)
            .flat_map(|row| &row[..packed as usize])
            .copied()
            .collect())
    }

    /// Reads a buffer that has `MAP_READ` usage, blocking until the device has finished.
    ///
    /// # Errors
    /// [`Error::Device`] when the device is lost or the buffer cannot be mapped.
    pub fn read_staging(&self, staging: &wgpu::Buffer) -> Result<Vec<u8>, Error> {
        read_staging(&self.device, staging)
    }
}

/// Reads a buffer that has `MAP_READ` usage, blocking until the device has finished.
pub(crate) fn read_staging(
    device: &wgpu::Device,
    staging: &wgpu::Buffer,
) -> Result<Vec<u8>, Error> {
    let (sender, receiver) = std::sync::mpsc::channel();
    staging.slice(..).map_async(wgpu::MapMode::Read, move |r| {
        // The receiver lives until the answer has come; a closed channel means that nobody wants it.
        let _ = sender.send(r);
    });
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|e| Error::Device(e.to_string()))?;
    receiver
        .recv()
        .map_err(|e| Error::Device(e.to_string()))?
        .map_err(|e| Error::Device(e.to_string()))?;
    let data = staging
        .slice(..)
        .get_mapped_range()
        .map_err(|e| Error::Device(e.to_string()))?
        .to_vec();
    staging.unmap();
    Ok(data)
}

#[cfg(feature = "compose")]
static SHARED: std::sync::OnceLock<Result<Gpu, Error>> = std::sync::OnceLock::new();

/// One device for everything in this process that needs no device of its own, opened at the first call.
///
/// # Errors
/// As [`Gpu::open`]; the first answer holds for all calls.
#[cfg(feature = "compose")]
pub fn shared() -> Result<&'static Gpu, Error> {
    SHARED
        .get_or_init(|| pollster::block_on(Gpu::open()))
        .as_ref()
        .map_err(Clone::clone)
}
