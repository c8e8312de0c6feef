#pragma once
#include <cmath>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/material/bsdf.hpp>
#include <lambent/material/charlie.hpp>
#include <lambent/material/delta.hpp>
#include <lambent/material/fresnel.hpp>
#include <lambent/material/ggx.hpp>
#include <lambent/material/ggx_albedo.hpp>
#include <lambent/material/glass_albedo.hpp>
#include <lambent/sampling/warp.hpp>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What the standard material is at one point: glTF's parameters after textures. The default is white Lambert.
template <class T>
struct StandardPoint {
    Vec3<T> base_color{1};     ///< linear, in [0, 1]
    T metallic = 0;            ///< in [0, 1]
    T roughness = 1;           ///< in [0, 1]; the facets' alpha is its square
    T ior = T(1.5);            ///< >= 1; of what lies behind the front side
    T specular = 0;            ///< strength of the dielectric reflection, in [0, 1]
    Vec3<T> specular_color{1}; ///< of that at normal incidence
    T transmission = 0;        ///< share of the light that enters and goes through instead of being scattered back
    bool thin = true;          ///< a sheet that does not refract; else the boundary of a volume
    bool front = true;         ///< seen from the front, outside of the volume
    T clearcoat = 0, clearcoat_roughness = 0; ///< in [0, 1]
    Vec3<T> sheen_color{0};                   ///< in [0, 1]; 0 = none
    T sheen_roughness = 0;                    ///< in [0, 1]
    /// Adds what facets would pass on from one to another, and lets no more be scattered than facets leave over: white
    /// metals, plastics, sheets and clear glass then give back all that they get at any roughness. glTF itself does
    /// neither.
    bool compensated = false;

    /// Whether nothing but diffuse reflection is left: then Lambert of `base_color` is the same.
    bool diffuse() const {
        return metallic <= 0 && specular <= 0 && transmission <= 0 && clearcoat <= 0 && is_black(sheen_color);
    }

    /// What the dielectric reflects at normal incidence.
    Vec3<T> f0() const { return min(Vec3<T>(dielectric_f0(ior)) * specular_color, Vec3<T>(1)) * specular; }

    /// Index of the side that light passes to over that of the viewer's; 1 where it is not bent.
    T eta() const {
        if (thin) return 1;
        return front ? ior : 1 / ior;
    }

    /// Roughly what share of the light it gives back or lets through, seen at this cosine: the reflectance that
    /// denoisers divide by.
    Vec3<T> albedo(T cosine) const {
        if (diffuse()) return base_color;
        const Vec3<T> f = schlick(f0(), specular, cosine);
        Vec3<T> result =
            metallic * schlick(base_color, T(1), cosine) + (1 - metallic) * (f + base_color * (1 - max_component(f)));
        if (!is_black(sheen_color)) {
            const T sheen = T(charlie_albedo(float(cosine), float(sheen_roughness)));
            result = result * (1 - max_component(sheen_color) * sheen) + sheen_color * sheen;
        }
        return min(result, Vec3<T>(1));
    }
};

/// The glTF 2.0 material: metal and dielectric mixed by `metallic`; the dielectric reflects by Fresnel, and scatters
/// back or lets through what is left; sheen over that, a clear coat on top. As glTF's, facets scatter light once, so
/// that rough white metals lose some, and white plastic gives back more than it gets at grazing angles, since Fresnel's
/// share is taken off what is scattered by the half vector and not by the view: `compensated` mends both, and scatters
/// evenly, to both sides, what the facets of a volume's boundary pass on to each other. Reciprocal
/// but for the coat, whose share goes by the view, for compensation, and for refraction, which scales radiance. Lobes:
/// diffuse, reflection, glass (both of its sides, chosen by Fresnel once the facet is known), sheen, coat; `sample`
/// chooses one by how much it gives of wo; f and pdf are of their sum. Lobes of roughness below a hundredth (see
/// Ggx::smallest_alpha) are exact mirrors, and so is the passage into a volume that hardly refracts.
/// source  glTF 2.0, appendix B; KHR_materials_specular, _ior, _transmission, _volume, _sheen, _clearcoat; rough
///         refraction by Walter et al., EGSR 2007; compensation by Turquin, Practical multiple scattering compensation
///         for microfacet models (2019)
template <class T>
class StandardBsdf {
public:
    using Scalar = T;

    explicit StandardBsdf(const StandardPoint<T>& p)
        : p_(p), facets_{alpha_of(p.roughness)}, coat_{alpha_of(p.clearcoat_roughness)},
          sheen_{glm::max(p.sheen_roughness, Charlie<T>::smallest_roughness)}, smooth_(is_smooth(p.roughness)),
          smooth_coat_(is_smooth(p.clearcoat_roughness)), straight_(!p.thin && glm::abs(p.ior - 1) < T(1e-3)),
          eta_(p.eta()), f0_(p.f0()), f0_max_(max_component(f0_)), base_max_(max_component(p.base_color)),
          sheen_max_(max_component(p.sheen_color)), opaque_((1 - p.metallic) * (1 - p.transmission)),
          glass_((1 - p.metallic) * p.transmission) {}

    /// Whether light samples can never contribute.
    bool only_delta() const {
        if (opaque_ > 0 || sheen_max_ > 0 || (p_.clearcoat > 0 && !smooth_coat_)) return false;
        return smooth_ || (straight_ && p_.metallic <= 0);
    }
    bool transmits() const { return glass_ > 0; }
    /// What a sheet, or a volume that does not refract, lets straight through, if it is clear: a delta lobe's reflectance.
    Vec3<T> straight_through(const Vec3<T>& wo) const {
        if (!(wo.z > 0) || !(glass_ > 0) || !(straight_ || (p_.thin && smooth_))) return Vec3<T>(0);
        return p_.base_color * (Vec3<T>(1) - boundary(glm::min(T(1), wo.z))) * (glass_ * View(*this, wo).base);
    }

    BsdfValue<T> evaluate(const Vec3<T>& wo, const Vec3<T>& wi) const {
        return wo.z > 0 ? evaluate(View(*this, wo), wo, wi) : BsdfValue<T>();
    }
    Vec3<T> eval(const Vec3<T>& wo, const Vec3<T>& wi) const { return evaluate(wo, wi).f; }
    T pdf(const Vec3<T>& wo, const Vec3<T>& wi) const { return evaluate(wo, wi).pdf; }

    BsdfSample<T> sample(const Vec3<T>& wo, T pick, const Vec2<T>& u) const {
        if (!(wo.z > 0)) return {};
        const View view(*this, wo);
        if (pick < view.diffuse) return finish(view, wo, square_to_cosine_hemisphere(u), 1, T(1));
        pick -= view.diffuse;
        if (pick < view.reflection)
            return smooth_ ? mirror(wo, opaque_reflectance(schlick_weight(wo.z)) * view.base, view.reflection)
                           : finish(view, wo, mirrored(wo, facets_.sample_bounded(wo, u)), 1, T(1));
        pick -= view.reflection;
        if (pick < view.glass) return sample_glass(view, wo, pick / view.glass, u);
        pick -= view.glass;
        if (pick < view.coat)
            return smooth_coat_ ? mirror(wo, Vec3<T>(view.coat_share), view.coat)
                                : finish(view, wo, mirrored(wo, coat_.sample_bounded(wo, u)), 1, T(1));
        pick -= view.coat;
        return pick < view.sheen ? finish(view, wo, square_to_uniform_hemisphere(u), 1, T(1)) : BsdfSample<T>();
    }

private:
    /// What depends on wo alone. Chances of lobes by what each is likely to give; together 1, or all 0. A lobe that
    /// gives anything anywhere has a chance.
    struct View {
        T diffuse = 0, reflection = 0, glass = 0, coat = 0, sheen = 0;
        T stretched = 0, bounded = 0; ///< of the facets: Ggx::stretched, Ggx::bounded_factor
        T miss = 0;                   ///< compensation: light that the facets lose over what they reflect
        T left = 1;                   ///< compensation: what the dielectric's facets leave to be scattered
        T glass_gain = 1;             ///< compensation: makes good for what a sheet's facets lose
        T again = 0, again_mirrored = 0; ///< compensation: what a volume's facets pass on to each other, and so is
                                         ///< scattered evenly; the share of that which comes back
        T coat_share = 0;
        T base = 1; ///< what coat and sheen let through to and from what is below, mirror-wise
        T sheen_albedo = 0, sheen_lambda = 0;

        View(const StandardBsdf& b, const Vec3<T>& wo) {
            const StandardPoint<T>& p = b.p_;
            T below = 1;
            if (p.clearcoat > 0) {
                coat = coat_share = p.clearcoat * (T(0.04) + T(0.96) * schlick_weight(wo.z));
                below -= coat_share;
            }
            if (b.sheen_max_ > 0) {
                sheen_lambda = b.sheen_.lambda(wo.z);
                sheen_albedo = T(charlie_albedo(float(wo.z), float(p.sheen_roughness)));
                sheen = below * glm::max(b.sheen_max_ * sheen_albedo, T(0.02));
                base = below * (1 - b.sheen_max_ * sheen_albedo);
            } else {
                base = below;
            }
            const bool reflects = p.metallic > 0 || b.opaque_ * p.specular > 0;
            if (!b.smooth_ && (reflects || b.glass_ > 0)) {
                stretched = b.facets_.stretched(wo);
                bounded = b.facets_.bounded_factor(wo, stretched);
            }
            if (p.compensated) {
                const Vec2f albedo = b.smooth_ ? Vec2f(1 - schlick_weight(float(wo.z)), schlick_weight(float(wo.z)))
                                               : ggx_albedo(float(wo.z), float(p.roughness));
                const T all = T(albedo.x) + T(albedo.y);
                miss = glm::max(T(0), 1 - all) / all;
                left =
                    glm::max(T(0), 1 - (b.f0_max_ * T(albedo.x) + p.specular * T(albedo.y)) * (1 + b.f0_max_ * miss));
                if (b.glass_ > 0 && p.thin) // whose facets reflect and pass on alike
                    glass_gain += miss;
                else if (b.glass_ > 0 && !b.sharp()) {
                    const Vec2f once = glass_albedo(float(wo.z), float(p.roughness), float(b.eta_), float(b.mirroring()));
                    again = glm::max(T(0), 1 - T(once.x + once.y));
                    again_mirrored = T(once.x / (once.x + once.y));
                }
            }
            // Facets stand otherwise than their mean: rough ones are seen less grazingly.
            const T seen = b.smooth_ ? wo.z : wo.z + b.facets_.alpha * T(0.7) * (T(0.6) - wo.z);
            if (reflects) {
                reflection = base * max_component(b.opaque_reflectance(schlick_weight(seen)));
                if (!b.smooth_) reflection = glm::max(reflection, T(0.02) * base);
            }
            if (b.opaque_ > 0)
                diffuse = base * b.opaque_ * b.base_max_ * (1 - b.f0_max_ - (p.specular - b.f0_max_) / 21);
            if (b.glass_ > 0) {
                const T mirror = max_component(b.boundary(wo.z));
                glass = base * b.glass_ * glm::max(mirror + b.base_max_ * (1 - mirror), T(0.05));
            }
            const T sum = diffuse + reflection + glass + coat + sheen;
            const T scale = sum > 0 ? 1 / sum : T(0);
            diffuse *= scale;
            reflection *= scale;
            glass *= scale;
            coat *= scale;
            sheen *= scale;
        }
    };

    static T alpha_of(T roughness) { return glm::max(roughness * roughness, Ggx<T>::smallest_alpha); }
    static bool is_smooth(T roughness) { return roughness * roughness < Ggx<T>::smallest_alpha; }

    /// Reflectances at a cosine of this schlick_weight: of the dielectric that scatters back; of metal and that, as
    /// mixed.
    Vec3<T> dielectric(T weight) const { return f0_ + (Vec3<T>(p_.specular) - f0_) * weight; }
    Vec3<T> opaque_reflectance(T weight, T miss = 0) const {
        Vec3<T> f(0);
        if (p_.metallic > 0)
            f = p_.metallic * (p_.base_color + (Vec3<T>(1) - p_.base_color) * weight) *
                (Vec3<T>(1) + p_.base_color * miss);
        if (opaque_ > 0) f += opaque_ * dielectric(weight) * (Vec3<T>(1) + f0_ * miss);
        return f;
    }
    /// Of the boundary of what lets through: KHR_materials_specular on top of the exact reflectance of a volume's
    /// outside.
    Vec3<T> boundary(T cosine) const {
        if (p_.thin) return dielectric(schlick_weight(cosine));
        T ignored = 0;
        const T exact = dielectric_reflectance(cosine, eta_, ignored);
        return p_.front ? min(p_.specular_color, Vec3<T>(1)) * (p_.specular * exact) : Vec3<T>(exact);
    }
    /// The most of what Fresnel's equations say that a volume's boundary mirrors.
    T mirroring() const {
        return p_.front ? max_component(min(p_.specular_color, Vec3<T>(1))) * p_.specular : T(1);
    }

    /// Whether glass has two directions only; the chance with which it mirrors rather than refracts at a facet.
    bool sharp() const { return smooth_ || straight_; }
    T mirrored_share(const Vec3<T>& boundary) const {
        const T mirror = max_component(boundary), passed = base_max_ * (1 - mirror);
        return mirror + passed > 0 ? mirror / (mirror + passed) : T(0);
    }

    /// What coat and sheen let through to what is below, and from there.
    T through(const View& view, T cos_i) const {
        if (!(sheen_max_ > 0)) return view.base;
        const T albedo = glm::max(view.sheen_albedo, T(charlie_albedo(float(cos_i), float(p_.sheen_roughness))));
        return (1 - view.coat_share) * (1 - sheen_max_ * albedo);
    }

    BsdfValue<T> evaluate(const View& view, const Vec3<T>& wo, const Vec3<T>& wi) const {
        if (wi.z > 0) return reflect(view, wo, wi);
        if (wi.z < 0 && glass_ > 0 && !sharp()) return transmit(view, wo, wi);
        return {};
    }

    BsdfValue<T> reflect(const View& view, const Vec3<T>& wo, const Vec3<T>& wi) const {
        const Vec3<T> h = wo + wi;
        const T cosine = glm::min(T(1), std::sqrt(dot(h, h)) / 2); // of wo and wi with h
        const T weight = schlick_weight(cosine);
        BsdfValue<T> v;
        if (opaque_ > 0) {
            const T share = p_.compensated ? view.left : 1 - f0_max_ - (p_.specular - f0_max_) * weight;
            v.f = p_.base_color * (opaque_ * share * inv_pi<T>);
            v.pdf = view.diffuse * wi.z * inv_pi<T>;
        }
        if (view.bounded > 0) {
            const T d = facets_.distribution(h);
            Vec3<T> reflectance = opaque_reflectance(weight, view.miss);
            T pdf = view.reflection * view.bounded;
            if (glass_ > 0 && !sharp()) {
                const Vec3<T> at = boundary(cosine);
                reflectance += glass_ * view.glass_gain * at;
                pdf += view.glass * (1 - view.again) * mirrored_share(at) * Ggx<T>::visible_factor(wo, view.stretched) / 4;
            }
            v.f += reflectance * (d * Ggx<T>::visibility(wo.z, view.stretched, wi.z, facets_.stretched(wi)));
            v.pdf += d * pdf;
            if (view.again > 0) {
                const T again = view.again * view.again_mirrored * inv_pi<T>;
                v.f += Vec3<T>(glass_ * again);
                v.pdf += view.glass * again * wi.z;
            }
        }
        if (sheen_max_ > 0) {
            const T over = 1 - view.coat_share;
            const T visibility = Charlie<T>::visibility(wo.z, view.sheen_lambda, wi.z, sheen_.lambda(wi.z));
            v.f = v.f * through(view, wi.z) + p_.sheen_color * (over * sheen_.distribution(h) * visibility);
            v.pdf += view.sheen * uniform_hemisphere_pdf<T>();
        } else {
            v.f *= view.base;
        }
        if (view.coat > 0 && !smooth_coat_) {
            const T d = coat_.distribution(h);
            const T stretched = coat_.stretched(wo);
            v.f += Vec3<T>(view.coat_share * d * Ggx<T>::visibility(wo.z, stretched, wi.z, coat_.stretched(wi)));
            v.pdf += view.coat * d * coat_.bounded_factor(wo, stretched);
        }
        return v;
    }

    BsdfValue<T> transmit(const View& view, const Vec3<T>& wo, const Vec3<T>& wi) const {
        BsdfValue<T> v = transmit_once(view, wo, wi);
        if (view.again > 0) {
            const T again = view.again * (1 - view.again_mirrored) * inv_pi<T>;
            v.f += p_.base_color * (glass_ * again * through(view, -wi.z) / (eta_ * eta_));
            v.pdf += view.glass * again * -wi.z;
        }
        return v;
    }

    /// By one facet.
    BsdfValue<T> transmit_once(const View& view, const Vec3<T>& wo, const Vec3<T>& wi) const {
        // Along the facet that refracts wo to wi; sheets mirror, and turn the mirrored direction to the other side.
        Vec3<T> h = p_.thin ? wo + Vec3<T>(wi.x, wi.y, -wi.z) : wo + eta_ * wi;
        if (h.z < 0) h = -h;
        const T length2 = dot(h, h);
        if (!(length2 > 0)) return {};
        const T scale = 1 / std::sqrt(length2), o = dot(wo, h) * scale;
        if (!(o > 0)) return {};
        T jacobian = 1 / (4 * o), bent = 1;
        if (!p_.thin) {
            const T i = dot(wi, h) * scale;
            if (!(i < 0)) return {};
            jacobian = -i * eta_ * eta_ / length2;
            bent = -4 * i * o / length2; // with radiance's 1 / eta²
        }
        const Vec3<T> at = boundary(glm::min(T(1), o));
        const T d = facets_.distribution(h);
        const T visibility = Ggx<T>::visibility(wo.z, view.stretched, -wi.z, facets_.stretched(wi));
        return {.f = p_.base_color * (Vec3<T>(1) - at) *
                     (glass_ * view.glass_gain * d * visibility * bent * through(view, -wi.z)),
                .pdf = view.glass * (1 - view.again) * (1 - mirrored_share(at)) * d * o * jacobian *
                       Ggx<T>::visible_factor(wo, view.stretched)};
    }

    /// The sample of a direction that is not a delta lobe's; none where a facet sent it to the wrong side.
    BsdfSample<T> finish(const View& view, const Vec3<T>& wo, const Vec3<T>& wi, T side, T eta_scale) const {
        if (!(wi.z * side > 0)) return {};
        const BsdfValue<T> v = evaluate(view, wo, wi);
        if (!(v.pdf > 0) || !is_finite(v.pdf)) return {};
        const Vec3<T> weight = v.f * (glm::abs(wi.z) / v.pdf);
        return {.wi = wi, .weight = weight, .pdf = v.pdf, .eta_scale = eta_scale};
    }

    static BsdfSample<T> mirror(const Vec3<T>& wo, const Vec3<T>& reflectance, T chance) {
        return {
            .wi = {-wo.x, -wo.y, wo.z}, .weight = reflectance / chance, .pdf = chance, .eta_scale = 1, .delta = true};
    }

    BsdfSample<T> sample_glass(const View& view, const Vec3<T>& wo, T pick, const Vec2<T>& u) const {
        if (pick < view.again) {
            const Vec3<T> wi = square_to_cosine_hemisphere(u);
            if (pick < view.again * view.again_mirrored) return finish(view, wo, wi, 1, T(1));
            return finish(view, wo, {wi.x, wi.y, -wi.z}, -1, eta_ * eta_);
        }
        pick = (pick - view.again) / (1 - view.again);
        const Vec3<T> m = sharp() ? Vec3<T>(0, 0, 1) : facets_.sample_visible(wo, u);
        const T o = glm::min(T(1), dot(wo, m));
        if (!(o > 0)) return {};
        const Vec3<T> at = boundary(o);
        const T chance = mirrored_share(at);
        if (pick < chance) {
            if (sharp()) return mirror(wo, at * (glass_ * view.base), view.glass * chance);
            return finish(view, wo, mirrored(wo, m), 1, T(1));
        }
        T cos_other = o;
        if (!p_.thin && !straight_) dielectric_reflectance(o, eta_, cos_other);
        if (!(cos_other > 0)) return {};
        if (sharp()) {
            const T eta = straight_ ? T(1) : eta_, passed = view.glass * (1 - chance);
            return {.wi = {-wo.x / eta, -wo.y / eta, -cos_other},
                    .weight = p_.base_color * (Vec3<T>(1) - at) * (glass_ * view.base / (passed * eta * eta)),
                    .pdf = passed,
                    .eta_scale = eta * eta,
                    .delta = true};
        }
        if (!p_.thin) return finish(view, wo, normalize(refracted(wo, m, o, cos_other, eta_)), -1, eta_ * eta_);
        const Vec3<T> wi = mirrored(wo, m);
        return finish(view, wo, {wi.x, wi.y, -wi.z}, -1, T(1));
    }

    StandardPoint<T> p_;
    Ggx<T> facets_, coat_;
    Charlie<T> sheen_;
    bool smooth_, smooth_coat_, straight_;
    T eta_;
    Vec3<T> f0_;
    T f0_max_, base_max_, sheen_max_;
    T opaque_, glass_; ///< shares of the dielectric that scatters back, and of the one that lets through
};

static_assert(Bsdf<StandardBsdf<float>>);

} // namespace LAMBENT_ABI
} // namespace lambent
