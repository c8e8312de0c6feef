#include "work.hpp"

Report wide_report() { return make_report(); }
