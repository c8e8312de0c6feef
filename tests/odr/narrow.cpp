#include "work.hpp"

Report narrow_report() { return make_report(); }
