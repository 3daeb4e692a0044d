//! Outdoor landscapes for wgpu.
