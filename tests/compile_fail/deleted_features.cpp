// names: deleted function
// A proof by construction: an integrator over a scene that is specialised for no feature needs no texture look-up and no
// microfacets, so it compiles where these are deleted. Over a scene that may have anything it does not.
#include <lambent/render/path.hpp>
#include <lambent/render/render.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/scene/specialised_scene.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

template <>
Vec4f look_up<float>(const Scene<float>&, const Texture&, const Attributes&) = delete;
template <>
Attributes attributes_at<float>(const Scene<float>&, std::uint32_t, float, float) = delete;
template <>
float coverage_at<float>(const Scene<float>&, const Material&, const Attributes&) = delete;
template <>
StandardPoint<float> standard_point<float>(const Scene<float>&, const Material&, const Attributes&, bool) = delete;
template <>
StandardBsdf<float>::StandardBsdf(const StandardPoint<float>&) = delete;
template <>
BsdfSample<float> StandardBsdf<float>::sample(const Vec3f&, float, const Vec2f&) const = delete;
template <>
BsdfValue<float> StandardBsdf<float>::evaluate(const Vec3f&, const Vec3f&) const = delete;

} // namespace LAMBENT_ABI
} // namespace lambent

lambent::RenderResult trace(const lambent::PreparedScene<float>& scene, const lambent::Camera& camera,
                            lambent::Film<float>& film) {
    using namespace lambent;
#ifdef RIGHT
    const SpecialisedScene<float, no_feature> traced(scene);
#else
    const PreparedScene<float>& traced = scene;
#endif
    SerialExecutor serial;
    return render(film, traced, camera, PathIntegrator<>{}, SobolSampler<float>(1), {}, serial, [] { return true; });
}
