//! Turns what the composer gives at run time into the tables that a build embeds.

use veduta::program::{
    Binding, ComposedProgram, EntryPoint, Member, Override, ScalarType, StageKind, StageSource,
    StructLayout,
};
use veduta::wgpu;
use veduta_compose::compose::Composed;
use veduta_compose::reflect;

use crate::error::CliError;

/// The tables of a composed program.
///
/// # Errors
/// [`CliError::Veduta`] for a storage format that `wgpu` does not have.
pub fn program(composed: &Composed) -> Result<ComposedProgram, CliError> {
    Ok(ComposedProgram {
        program: composed.program.clone().into(),
        features: composed.features.iter().cloned().map(Into::into).collect(),
        stages: composed
            .stages
            .iter()
            .map(|stage| StageSource {
                stage: stage_kind(stage.kind),
                wgsl: stage.wgsl.clone().into(),
                entry_points: stage
                    .entry_points
                    .iter()
                    .map(|entry| EntryPoint {
                        name: entry.name.clone().into(),
                        workgroup_size: entry.workgroup_size,
                    })
                    .collect(),
            })
            .collect(),
        bindings: composed
            .bindings
            .iter()
            .map(|binding| {
                Ok(Binding {
                    group: binding.group,
                    binding: binding.binding,
                    name: binding.name.clone().into(),
                    ty: binding_type(binding.ty)?,
                    visibility: stages(binding.visibility),
                })
            })
            .collect::<Result<_, CliError>>()?,
        overrides: composed
            .overrides
            .iter()
            .map(|item| Override {
                // A host addresses an override with a number by that number.
                name: item
                    .id
                    .map_or_else(|| item.name.clone(), |id| id.to_string())
                    .into(),
                stages: stages(item.visibility),
                ty: match item.ty {
                    reflect::ScalarType::Bool => ScalarType::Bool,
                    reflect::ScalarType::I32 => ScalarType::I32,
                    reflect::ScalarType::U32 => ScalarType::U32,
                    reflect::ScalarType::F32 => ScalarType::F32,
                },
                default: item.default,
            })
            .collect(),
        structs: composed
            .structs
            .iter()
            .map(|layout| StructLayout {
                name: layout.name.clone().into(),
                size: layout.size,
                members: layout
                    .members
                    .iter()
                    .map(|member| Member {
                        name: member.name.clone().into(),
                        offset: member.offset,
                        ty: member.ty.wgsl().into(),
                    })
                    .collect(),
            })
            .collect(),
    })
}

fn stage_kind(kind: reflect::StageKind) -> StageKind {
    match kind {
        reflect::StageKind::Vertex => StageKind::Vertex,
        reflect::StageKind::Fragment => StageKind::Fragment,
        reflect::StageKind::Compute => StageKind::Compute,
    }
}

fn stages(visibility: reflect::Visibility) -> wgpu::ShaderStages {
    let mut stages = wgpu::ShaderStages::NONE;
    stages.set(wgpu::ShaderStages::VERTEX, visibility.vertex);
    stages.set(wgpu::ShaderStages::FRAGMENT, visibility.fragment);
    stages.set(wgpu::ShaderStages::COMPUTE, visibility.compute);
    stages
}

fn dimension(dim: reflect::ViewDimension) -> wgpu::TextureViewDimension {
    match dim {
        reflect::ViewDimension::D1 => wgpu::TextureViewDimension::D1,
        reflect::ViewDimension::D2 => wgpu::TextureViewDimension::D2,
        reflect::ViewDimension::D2Array => wgpu::TextureViewDimension::D2Array,
        reflect::ViewDimension::Cube => wgpu::TextureViewDimension::Cube,
        reflect::ViewDimension::CubeArray => wgpu::TextureViewDimension::CubeArray,
        reflect::ViewDimension::D3 => wgpu::TextureViewDimension::D3,
    }
}

fn buffer(ty: wgpu::BufferBindingType, min_size: u64) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: std::num::NonZeroU64::new(min_size),
    }
}

fn binding_type(ty: reflect::BindingType) -> Result<wgpu::BindingType, CliError> {
    use reflect::BindingType as B;
    Ok(match ty {
        B::Uniform { min_size } => buffer(wgpu::BufferBindingType::Uniform, min_size),
        B::Storage {
            read_only,
            min_size,
        } => buffer(wgpu::BufferBindingType::Storage { read_only }, min_size),
        B::Texture {
            sample,
            dim,
            multisampled,
        } => wgpu::BindingType::Texture {
            sample_type: match sample {
                reflect::SampleType::Float { filterable } => {
                    wgpu::TextureSampleType::Float { filterable }
                }
                reflect::SampleType::Depth => wgpu::TextureSampleType::Depth,
                reflect::SampleType::Sint => wgpu::TextureSampleType::Sint,
                reflect::SampleType::Uint => wgpu::TextureSampleType::Uint,
            },
            view_dimension: dimension(dim),
            multisampled,
        },
        B::StorageTexture {
            format,
            access,
            dim,
        } => wgpu::BindingType::StorageTexture {
            access: match access {
                reflect::Access::Read => wgpu::StorageTextureAccess::ReadOnly,
                reflect::Access::Write => wgpu::StorageTextureAccess::WriteOnly,
                reflect::Access::ReadWrite => wgpu::StorageTextureAccess::ReadWrite,
            },
            // Both name a format alike.
            format: storage_format(&format!("{format:?}"))?,
            view_dimension: dimension(dim),
        },
        B::Sampler { comparison } => wgpu::BindingType::Sampler(if comparison {
            wgpu::SamplerBindingType::Comparison
        } else {
            wgpu::SamplerBindingType::Filtering
        }),
    })
}

fn storage_format(name: &str) -> Result<wgpu::TextureFormat, CliError> {
    use wgpu::TextureFormat as F;
    const FORMATS: [F; 40] = [
        F::R8Unorm,
        F::R8Snorm,
        F::R8Uint,
        F::R8Sint,
        F::R16Uint,
        F::R16Sint,
        F::R16Float,
        F::Rg8Unorm,
        F::Rg8Snorm,
        F::Rg8Uint,
        F::Rg8Sint,
        F::R32Uint,
        F::R32Sint,
        F::R32Float,
        F::Rg16Uint,
        F::Rg16Sint,
        F::Rg16Float,
        F::Rgba8Unorm,
        F::Rgba8Snorm,
        F::Rgba8Uint,
        F::Rgba8Sint,
        F::Bgra8Unorm,
        F::Rgb10a2Uint,
        F::Rgb10a2Unorm,
        F::Rg11b10Ufloat,
        F::Rg32Uint,
        F::Rg32Sint,
        F::Rg32Float,
        F::Rgba16Uint,
        F::Rgba16Sint,
        F::Rgba16Float,
        F::Rgba32Uint,
        F::Rgba32Sint,
        F::Rgba32Float,
        F::R16Unorm,
        F::R16Snorm,
        F::Rg16Unorm,
        F::Rg16Snorm,
        F::Rgba16Unorm,
        F::Rgba16Snorm,
    ];
    FORMATS
        .into_iter()
        .find(|f| format!("{f:?}") == name)
        .ok_or_else(|| {
            veduta::Error::MissingFeature {
                name: format!("storage format {name}"),
                why: "the program uses".to_owned(),
            }
            .into()
        })
}
