//! The three programs that run on the device: project, count, compact.

/// Compiled programs.
#[derive(Debug)]
pub(super) struct Pipelines {
    /// Layout of the cameras, for both pipelines that project.
    pub(super) cameras: wgpu::BindGroupLayout,
    /// Projects source triangles, seen from either side.
    pub(super) sources: wgpu::RenderPipeline,
    /// Projects patches, each seen from its own side.
    pub(super) patches: wgpu::RenderPipeline,
    /// Projects source triangles a little behind the patches on them.
    pub(super) backing: wgpu::RenderPipeline,
    /// Sums delta form factors.
    pub(super) count: wgpu::ComputePipeline,
    /// Gathers the sums above zero.
    pub(super) compact: wgpu::ComputePipeline,
}

/// Items.
pub(super) const ITEMS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// Nearness: single precision, greater is nearer (reversed z).
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Nearness of source triangles relative to the patches on them: farther by more than single
/// precision may err over a large triangle, and by less than surfaces lie apart.
const BEHIND: f64 = 1.0 - 1.0 / 16_384.0;

impl Pipelines {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let project = device.create_shader_module(wgpu::include_wgsl!("project.wgsl"));
        let count = device.create_shader_module(wgpu::include_wgsl!("count.wgsl"));
        let compact = device.create_shader_module(wgpu::include_wgsl!("compact.wgsl"));
        let cameras = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("cameras"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: true },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("project"),
            bind_group_layouts: &[Some(&cameras)],
            immediate_size: 0,
        });
        let render = |label, nearness, cull_mode| {
            render_pipeline(device, &layout, &project, label, nearness, cull_mode)
        };
        let compute = |module, entry| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: None,
                module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        };
        Self {
            sources: render("sources", 1.0, None),
            patches: render("patches", 1.0, Some(wgpu::Face::Back)),
            backing: render("backing", BEHIND, None),
            count: compute(&count, "count"),
            compact: compute(&compact, "compact"),
            cameras,
        }
    }
}

fn render_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    label: &str,
    nearness: f64,
    cull_mode: Option<wgpu::Face>,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("project"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &[("nearness", nearness)],
                ..Default::default()
            },
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: 16,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32],
            })],
        },
        primitive: wgpu::PrimitiveState {
            front_face: wgpu::FrontFace::Ccw,
            cull_mode,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("keep"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(ITEMS.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
