#include <denoise/bilateral_cases.hpp>
#include <doctest/doctest.h>
#include <support/skip.hpp>

using namespace lambent;
using namespace lambent_test;

TEST_CASE_TEMPLATE("the original's filter: every form reproduces its outputs", T, float, double) {
    auto planes = seed_case<T>();
    if (!planes) return skip("the original's outputs, seed/cases is not there");
    CHECK(suppress_fireflies_seed(planes->image.view(), 25) > 0);

    struct Case {
        const char* name;
        BilateralForm form;
        SecondPassGuide guide;
    };
    for (const Case& c : {Case{"n", BilateralForm::naive_2d, SecondPassGuide::input},
                          {"N", BilateralForm::reuse_2d, SecondPassGuide::input},
                          {"s", BilateralForm::separable, SecondPassGuide::input},
                          {"S", BilateralForm::separable, SecondPassGuide::first_pass},
                          {"l", BilateralForm::separable_reuse, SecondPassGuide::input},
                          {"f", BilateralForm::separable_reuse, SecondPassGuide::first_pass}}) {
        CAPTURE(c.name);
        const auto expected = seed_plane<T>(std::string("out_") + c.name);
        REQUIRE(expected);
        const Plane<T, 3> result = filter(*planes, seed_options(c.form, c.guide));
        CHECK(largest_difference(result, *expected) < 1e-5);
    }
    // The fault of the original (half-filled sums as guide) is not there.
    const auto faulty = seed_plane<T>("out_r");
    REQUIRE(faulty);
    CHECK(largest_difference(filter(*planes, seed_options(BilateralForm::separable_reuse)), *faulty) > 1e-3);
}
