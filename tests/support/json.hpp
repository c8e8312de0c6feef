#pragma once
#include <cctype>
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace lambent_test {

/// A JSON value, for reading well-formed test data; escapes other than \" \\ \/ are not decoded.
struct Json {
    double number = 0;
    std::string text;
    std::vector<Json> array;
    std::map<std::string, Json> object;

    static Json parse(const std::string& source) {
        const char* p = source.c_str();
        return value(p);
    }
    bool has(const std::string& key) const { return object.contains(key); }
    const Json& operator[](const std::string& key) const { return object.at(key); }

private:
    static void skip(const char*& p) {
        while (std::isspace(static_cast<unsigned char>(*p)) || *p == ',' || *p == ':') ++p;
    }
    static std::string string(const char*& p) {
        std::string out;
        for (++p; *p != '"' && *p != 0; ++p) {
            if (*p == '\\') ++p;
            out += *p;
        }
        ++p;
        return out;
    }
    static Json value(const char*& p) {
        Json out;
        skip(p);
        if (*p == '{') {
            for (++p, skip(p); *p != '}'; skip(p)) {
                if (*p != '"') throw std::runtime_error("JSON: a key was expected");
                const std::string key = string(p);
                out.object[key] = value(p);
            }
            ++p;
        } else if (*p == '[') {
            for (++p, skip(p); *p != ']'; skip(p)) {
                if (*p == 0) throw std::runtime_error("JSON: the array does not end");
                out.array.push_back(value(p));
            }
            ++p;
        } else if (*p == '"') {
            out.text = string(p);
        } else {
            char* end = nullptr;
            out.number = std::strtod(p, &end);
            if (end == p)
                while (std::isalpha(static_cast<unsigned char>(*end))) out.text += *end++;
            if (end == p) throw std::runtime_error("JSON: a value was expected");
            p = end;
        }
        return out;
    }
};

} // namespace lambent_test
