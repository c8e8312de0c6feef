#pragma once
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/material/bsdf.hpp>
#include <lambent/material/fresnel.hpp>
#include <lambent/material/ggx.hpp>
#include <lambent/sampling/warp.hpp>
#include <algorithm>
#include <cmath>

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
    T clearcoat = 0, clearcoat_roughness = 0;

    /// Whether nothing but diffuse reflection is left.
    bool diffuse() const { return metallic <= 0 && specular <= 0 && transmission <= 0 && clearcoat <= 0; }

    /// Roughly what share of the light it gives back or lets through, seen at this cosine: the reflectance that denoisers
    /// divide by.
    Vec3<T> albedo(T cosine) const {
        if (diffuse()) return base_color;
        const Vec3<T> f0 = min(Vec3<T>(dielectric_f0(ior)) * specular_color, Vec3<T>(1)) * specular;
        const Vec3<T> f = schlick(f0, specular, cosine);
        return min(metallic * schlick(base_color, T(1), cosine) + (1 - metallic) * (f + base_color * (1 - max_component(f))),
                   Vec3<T>(1));
    }
};

/// The glTF 2.0 material: metal and dielectric mixed by `metallic`; the dielectric reflects by Fresnel, and scatters back
/// or lets through what is left; a clear coat on top. Microfacets scatter once, as glTF has it, so rough white metals lose
/// light. Lobes: diffuse, reflection, glass (both of its sides, chosen by Fresnel once the facet is known), coat; `sample`
/// chooses one by how much it gives of wo, and eval and pdf are of their sum. Lobes of roughness below a hundredth are exact
/// mirrors, and so is the passage into a volume that does not refract.
/// source  glTF 2.0, appendix B; KHR_materials_specular, _ior, _transmission, _volume, _clearcoat; rough refraction by
///         Walter et al., EGSR 2007
template <class T>
class StandardBsdf {
public:
    using Scalar = T;

    explicit StandardBsdf(const StandardPoint<T>& p)
        : p_(p), facets_{glm::max(p.roughness * p.roughness, Ggx<T>::smallest_alpha)},
          coat_{glm::max(p.clearcoat_roughness * p.clearcoat_roughness, Ggx<T>::smallest_alpha)},
          smooth_(p.roughness * p.roughness < Ggx<T>::smallest_alpha),
          smooth_coat_(p.clearcoat_roughness * p.clearcoat_roughness < Ggx<T>::smallest_alpha),
          eta_(p.thin ? T(1) : p.front ? p.ior : 1 / p.ior), straight_(!p.thin && glm::abs(p.ior - 1) < T(1e-3)),
          f0_(min(Vec3<T>(dielectric_f0(p.ior)) * p.specular_color, Vec3<T>(1)) * p.specular) {}

    /// Whether light samples can never contribute.
    bool only_delta() const {
        const bool clear = p_.transmission >= 1 && p_.metallic <= 0;
        return (smooth_ ? p_.metallic >= 1 || p_.transmission >= 1 : clear && straight_) && (smooth_coat_ || p_.clearcoat <= 0);
    }
    bool transmits() const { return p_.transmission > 0 && p_.metallic < 1; }

    Vec3<T> eval(const Vec3<T>& wo, const Vec3<T>& wi) const {
        if (!(wo.z > 0) || wi.z == 0) return Vec3<T>(0);
        return wi.z > 0 ? reflected(wo, wi) : transmitted(wo, wi);
    }

    T pdf(const Vec3<T>& wo, const Vec3<T>& wi) const {
        if (!(wo.z > 0) || wi.z == 0) return 0;
        const Chances chance = chances(wo);
        if (wi.z < 0) return chance.glass > 0 && !sharp() ? chance.glass * transmission_pdf(wo, wi) : T(0);
        T sum = chance.diffuse * wi.z * inv_pi<T>;
        const Vec3<T> m = normalize(wo + wi);
        if (chance.reflection > 0 && !smooth_) sum += chance.reflection * facets_.bounded_pdf(wo, m);
        if (chance.glass > 0 && !sharp())
            sum += chance.glass * facets_.visible_pdf(wo, m) / (4 * dot(wo, m)) * mirrored_share(dot(wo, m));
        if (chance.coat > 0 && !smooth_coat_) sum += chance.coat * coat_.bounded_pdf(wo, m);
        return sum;
    }

    BsdfSample<T> sample(const Vec3<T>& wo, T pick, const Vec2<T>& u) const {
        if (!(wo.z > 0)) return {};
        const Chances chance = chances(wo);
        if (pick < chance.coat)
            return smooth_coat_ ? mirror(wo, Vec3<T>(coat_share(wo)), chance.coat)
                                : finish(wo, reflect(wo, coat_.sample_bounded(wo, u)), T(1));
        pick -= chance.coat;
        if (pick < chance.reflection)
            return smooth_ ? mirror(wo, under_coat(wo) * opaque_reflectance(wo.z), chance.reflection)
                           : finish(wo, reflect(wo, facets_.sample_bounded(wo, u)), T(1));
        pick -= chance.reflection;
        if (pick < chance.glass) return sample_glass(wo, chance.glass, pick / chance.glass, u);
        if (!(chance.diffuse > 0)) return {};
        return finish(wo, square_to_cosine_hemisphere(u), T(1));
    }

private:
    struct Chances {
        T diffuse = 0, reflection = 0, glass = 0, coat = 0;
    };

    static Vec3<T> reflect(const Vec3<T>& wo, const Vec3<T>& m) { return 2 * dot(wo, m) * m - wo; }

    /// Fresnel of the dielectric that scatters back, of the metal, and of the boundary of what lets through.
    Vec3<T> dielectric(T cosine) const { return schlick(f0_, p_.specular, cosine); }
    Vec3<T> metal(T cosine) const { return schlick(p_.base_color, T(1), cosine); }
    Vec3<T> boundary(T cosine) const {
        if (p_.thin) return dielectric(cosine);
        T ignored = 0;
        return Vec3<T>(dielectric_reflectance(cosine, eta_, ignored)) * boundary_tint();
    }
    /// KHR_materials_specular on top of the exact reflectance, which total reflection leaves as it is.
    Vec3<T> boundary_tint() const {
        return p_.front ? min(p_.specular_color, Vec3<T>(1)) * p_.specular : Vec3<T>(1);
    }

    T coat_share(const Vec3<T>& wo) const {
        return p_.clearcoat > 0 ? p_.clearcoat * schlick(Vec3<T>(T(0.04)), T(1), glm::abs(wo.z)).x : T(0);
    }
    T under_coat(const Vec3<T>& wo) const { return 1 - coat_share(wo); }

    /// What facets reflect at this cosine, without the glass.
    Vec3<T> opaque_reflectance(T cosine) const {
        Vec3<T> f = p_.metallic > 0 ? p_.metallic * metal(cosine) : Vec3<T>(0);
        const T rest = (1 - p_.metallic) * (1 - p_.transmission);
        if (rest > 0) f += rest * dielectric(cosine);
        return f;
    }
    T glass_share() const { return (1 - p_.metallic) * p_.transmission; }

    /// Whether glass has two directions only; the chance with which it mirrors at a facet rather than refracts.
    bool sharp() const { return smooth_ || straight_; }
    T mirrored_share(T cosine) const {
        const T mirrored = max_component(boundary(cosine)), passed = max_component(p_.base_color) * (1 - mirrored);
        return mirrored + passed > 0 ? mirrored / (mirrored + passed) : T(0);
    }

    Vec3<T> reflected(const Vec3<T>& wo, const Vec3<T>& wi) const {
        const Vec3<T> m = normalize(wo + wi);
        const T cosine = glm::min(T(1), dot(wo, m));
        Vec3<T> f(0);
        const T scattered = (1 - p_.metallic) * (1 - p_.transmission);
        if (scattered > 0) f += p_.base_color * (scattered * inv_pi<T> * (1 - max_component(dielectric(cosine))));
        Vec3<T> facets = smooth_ ? Vec3<T>(0) : opaque_reflectance(cosine);
        if (glass_share() > 0 && !sharp()) facets += glass_share() * boundary(cosine);
        if (!is_black(facets)) f += facets * (facets_.distribution(m) * facets_.visibility(wo, wi));
        if (p_.clearcoat > 0) {
            const T share = coat_share(wo);
            f *= 1 - share;
            if (!smooth_coat_) f += Vec3<T>(share * coat_.distribution(m) * coat_.visibility(wo, wi));
        }
        return f;
    }

    /// Facet that refracts wo to wi, on the side of wo; eta_ is 1 for sheets, which turn reflections to the other side.
    Vec3<T> refracting(const Vec3<T>& wo, const Vec3<T>& wi) const {
        const Vec3<T> m = p_.thin ? wo + Vec3<T>(wi.x, wi.y, -wi.z) : wo + eta_ * wi;
        const T size = length(m);
        return size > 0 ? (m.z < 0 ? -m : m) / size : Vec3<T>(0, 0, 1);
    }

    Vec3<T> transmitted(const Vec3<T>& wo, const Vec3<T>& wi) const {
        if (!(glass_share() > 0) || sharp()) return Vec3<T>(0);
        const Vec3<T> m = refracting(wo, wi);
        const T o = dot(wo, m);
        T f = facets_.distribution(m) * facets_.visibility(wo, wi);
        if (!p_.thin) {
            const T i = dot(wi, m);
            if (!(o > 0) || !(i < 0)) return Vec3<T>(0);
            const T root = i + o / eta_; // radiance is scaled by 1 / eta², which is in it
            f *= 4 * glm::abs(i * o) / (root * root * eta_ * eta_);
        }
        return p_.base_color * (Vec3<T>(1) - boundary(glm::min(T(1), o))) * (glass_share() * f * under_coat(wo));
    }

    T transmission_pdf(const Vec3<T>& wo, const Vec3<T>& wi) const {
        const Vec3<T> m = refracting(wo, wi);
        const T o = dot(wo, m);
        if (!(o > 0)) return 0;
        const T facet = facets_.visible_pdf(wo, m) * (1 - mirrored_share(o));
        if (p_.thin) return facet / (4 * o);
        const T i = dot(wi, m), root = i + o / eta_;
        return i < 0 ? facet * -i / (root * root) : T(0);
    }

    /// By what each lobe is likely to give of wo; together 1. A lobe that gives anything anywhere has a chance: that of
    /// facets, which stand otherwise than the mean one, has a floor; diffuse light takes the mean over all directions.
    Chances chances(const Vec3<T>& wo) const {
        const T base = max_component(p_.base_color), rest = 1 - p_.metallic;
        Chances c;
        c.coat = coat_share(wo);
        const T under = 1 - c.coat, scattered = rest * (1 - p_.transmission);
        const T mean = max_component(f0_ + (Vec3<T>(p_.specular) - f0_) / T(21));
        c.diffuse = under * scattered * base * (1 - mean);
        c.reflection = under * max_component(opaque_reflectance(wo.z));
        if (!smooth_ && (p_.metallic > 0 || scattered * p_.specular > 0)) c.reflection = glm::max(c.reflection, T(0.02));
        if (transmits()) {
            const T mirrored = max_component(boundary(wo.z));
            c.glass = under * glass_share() * glm::max(mirrored + base * (1 - mirrored), T(0.05));
        }
        const T sum = c.diffuse + c.reflection + c.glass + c.coat;
        if (!(sum > 0)) return {};
        c.diffuse /= sum;
        c.reflection /= sum;
        c.glass /= sum;
        c.coat /= sum;
        return c;
    }

    /// The sample of a direction that is not a delta lobe's.
    BsdfSample<T> finish(const Vec3<T>& wo, const Vec3<T>& wi, T eta_scale) const {
        BsdfSample<T> s;
        s.pdf = pdf(wo, wi);
        if (!(s.pdf > 0) || !is_finite(s.pdf)) return {};
        s.wi = wi;
        s.weight = eval(wo, wi) * (glm::abs(wi.z) / s.pdf);
        s.eta_scale = eta_scale;
        return s;
    }

    static BsdfSample<T> mirror(const Vec3<T>& wo, const Vec3<T>& reflectance, T chance) {
        return {.wi = {-wo.x, -wo.y, wo.z}, .weight = reflectance / chance, .pdf = chance, .eta_scale = 1, .delta = true};
    }

    BsdfSample<T> sample_glass(const Vec3<T>& wo, T chance, T pick, const Vec2<T>& u) const {
        const Vec3<T> m = sharp() ? Vec3<T>(0, 0, 1) : facets_.sample_visible(wo, u);
        const T o = dot(wo, m);
        if (!(o > 0)) return {};
        const T mirrored = mirrored_share(o);
        const Vec3<T> share = Vec3<T>(glass_share() * under_coat(wo));
        if (pick < mirrored) {
            if (sharp()) return mirror(wo, share * boundary(o), chance * mirrored);
            const Vec3<T> wi = reflect(wo, m);
            return wi.z > 0 ? finish(wo, wi, T(1)) : BsdfSample<T>();
        }
        T cosine = o;
        if (!p_.thin && !straight_) dielectric_reflectance(o, eta_, cosine);
        if (!(cosine > 0)) return {};
        if (sharp()) {
            const T eta = straight_ ? T(1) : eta_, passed = chance * (1 - mirrored);
            return {.wi = {-wo.x / eta, -wo.y / eta, -cosine},
                    .weight = share * p_.base_color * (Vec3<T>(1) - boundary(o)) / (passed * eta * eta),
                    .pdf = passed, .eta_scale = eta * eta, .delta = true};
        }
        Vec3<T> wi;
        if (p_.thin) {
            wi = reflect(wo, m);
            wi.z = -wi.z;
        } else {
            wi = normalize((o / eta_ - cosine) * m - wo / eta_);
        }
        return wi.z < 0 ? finish(wo, wi, eta_ * eta_) : BsdfSample<T>();
    }

    StandardPoint<T> p_;
    Ggx<T> facets_, coat_;
    bool smooth_, smooth_coat_;
    T eta_;
    bool straight_;
    Vec3<T> f0_;
};

static_assert(Bsdf<StandardBsdf<float>>);

} // namespace LAMBENT_ABI
} // namespace lambent
