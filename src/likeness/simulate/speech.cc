#include "likeness/simulate/speech.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>

#include "likeness/base/error.h"

namespace likeness {
namespace {

constexpr double kSecondsPerPhoneme = 0.09;

// A mouth shape: sides are raised together where a name has no side.
struct Viseme {
  double dominance = 1;
  std::vector<std::pair<std::string, double>> weights;
};

const std::map<std::string, Viseme, std::less<>>& Visemes() {
  static const auto table = [] {
    const Viseme rest{0.6, {}};
    const Viseme closed{2.5, {{"mouthClose", 0.06}, {"mouthPress", 0.45}, {"mouthRollLower", 0.25}, {"jawOpen", 0.03}}};
    const Viseme labiodental{2.2, {{"mouthRollLower", 0.5}, {"mouthUpperUp", 0.3}, {"jawOpen", 0.06}}};
    const Viseme dental{1.2, {{"jawOpen", 0.14}, {"tongueOut", 0.25}, {"mouthLowerDown", 0.2}}};
    const Viseme alveolar{0.8, {{"jawOpen", 0.12}, {"mouthLowerDown", 0.25}, {"mouthUpperUp", 0.12}}};
    const Viseme sibilant{1.3,
                          {{"jawOpen", 0.04}, {"mouthStretch", 0.35}, {"mouthLowerDown", 0.35}, {"mouthUpperUp", 0.2}}};
    const Viseme postalveolar{1.5, {{"mouthFunnel", 0.55}, {"jawOpen", 0.08}, {"mouthPucker", 0.2}}};
    const Viseme velar{0.6, {{"jawOpen", 0.16}, {"mouthStretch", 0.1}}};
    const Viseme rhotic{1.1, {{"mouthFunnel", 0.35}, {"mouthPucker", 0.3}, {"jawOpen", 0.12}}};
    const Viseme rounded{1.8, {{"mouthPucker", 0.75}, {"mouthFunnel", 0.25}, {"jawOpen", 0.08}}};
    const Viseme open{1.4, {{"jawOpen", 0.55}, {"mouthLowerDown", 0.3}, {"mouthUpperUp", 0.15}}};
    const Viseme open_front{1.3,
                            {{"jawOpen", 0.42}, {"mouthStretch", 0.3}, {"mouthUpperUp", 0.25}, {"mouthSmile", 0.15}}};
    const Viseme mid{1.0, {{"jawOpen", 0.27}, {"mouthLowerDown", 0.15}}};
    const Viseme open_rounded{1.5, {{"jawOpen", 0.42}, {"mouthFunnel", 0.5}}};
    const Viseme mid_rounded{1.5, {{"jawOpen", 0.24}, {"mouthFunnel", 0.4}, {"mouthPucker", 0.35}}};
    const Viseme spread{1.4, {{"jawOpen", 0.08}, {"mouthSmile", 0.4}, {"mouthStretch", 0.3}, {"mouthUpperUp", 0.1}}};
    const Viseme near_spread{1.0, {{"jawOpen", 0.17}, {"mouthSmile", 0.2}, {"mouthStretch", 0.15}}};
    return std::map<std::string, Viseme, std::less<>>{
        {"_", rest},          {"P", closed},        {"B", closed},        {"M", closed},        {"F", labiodental},
        {"V", labiodental},   {"TH", dental},       {"DH", dental},       {"T", alveolar},      {"D", alveolar},
        {"N", alveolar},      {"L", alveolar},      {"S", sibilant},      {"Z", sibilant},      {"SH", postalveolar},
        {"ZH", postalveolar}, {"CH", postalveolar}, {"JH", postalveolar}, {"K", velar},         {"G", velar},
        {"NG", velar},        {"HH", velar},        {"R", rhotic},        {"ER", rhotic},       {"W", rounded},
        {"UW", rounded},      {"AA", open},         {"AY", open},         {"AW", open},         {"AE", open_front},
        {"EH", open_front},   {"AH", mid},          {"AO", open_rounded}, {"OY", open_rounded}, {"OW", mid_rounded},
        {"UH", mid_rounded},  {"IY", spread},       {"Y", spread},        {"EY", spread},       {"IH", near_spread},
    };
  }();
  return table;
}

std::vector<const Viseme*> VisemesOf(const Sentence& sentence) {
  std::vector<const Viseme*> visemes;
  std::istringstream words(sentence.phonemes);
  for (std::string word; words >> word;) {
    const auto found = Visemes().find(word);
    if (found == Visemes().end()) throw Error("sentence {} has an unknown phoneme '{}'", sentence.name, word);
    visemes.push_back(&found->second);
  }
  return visemes;
}

bool HasSides(std::string_view name) {
  static constexpr std::array<std::string_view, 6> kSided = {"mouthPress",   "mouthUpperUp", "mouthLowerDown",
                                                             "mouthStretch", "mouthSmile",   "mouthDimple"};
  return std::find(kSided.begin(), kSided.end(), name) != kSided.end();
}

}  // namespace

const std::vector<Sentence>& BuiltInSentences() {
  static const std::vector<Sentence> sentences = {
      {"SEN_the_boy_was_there_when_the_sun_rose", "_ DH AH B AO IY W AA Z DH EH R W EH N DH AH S AH N R OW Z _"},
      {"SEN_a_rod_is_used_to_catch_pink_salmon", "_ AH R AA D IH Z Y UW Z D T UW K AE CH P IH NG K S AE M AH N _"},
      {"SEN_four_hours_of_steady_work_faced_us", "_ F AO R AW R Z AH V S T EH D IY W ER K F EY S T AH S _"},
      {"SEN_the_hogs_were_fed_chopped_corn", "_ DH AH HH AA G Z W ER F EH D CH AA P T K AO R N _"},
      {"SEN_the_kite_flew_over_the_old_mill", "_ DH AH K AY T F L UW OW V ER DH IY OW L D M IH L _"},
      {"SEN_she_poured_warm_milk_into_a_cup", "_ SH IY P AO R D W AO R M M IH L K IH N T UW AH K AH P _"},
      {"SEN_five_brown_dogs_ran_by_the_river", "_ F AY V B R AW N D AA G Z R AE N B AY DH AH R IH V ER _"},
      {"SEN_keep_both_hands_on_the_wheel", "_ K IY P B OW TH HH AE N D Z AA N DH AH W IY L _"},
      {"SEN_the_bus_to_town_comes_at_eight", "_ DH AH B AH S T UW T AW N K AH M Z AE T EY T _"},
      {"SEN_my_brother_fixed_the_garden_fence", "_ M AY B R AH DH ER F IH K S T DH AH G AA R D AH N F EH N S _"},
      {"SEN_a_thick_fog_hid_the_harbour", "_ AH TH IH K F AA G HH IH D DH AH HH AA R B ER _"},
      {"SEN_please_move_that_box_with_care", "_ P L IY Z M UW V DH AE T B AA K S W IH TH K EH R _"},
      {"SEN_the_judge_asked_for_more_proof", "_ DH AH JH AH JH AE S K T F AO R M AO R P R UW F _"},
      {"SEN_we_found_a_purple_shell_on_the_beach", "_ W IY F AW N D AH P ER P AH L SH EH L AA N DH AH B IY CH _"},
      {"SEN_bob_and_mum_baked_apple_pie", "_ B AA B AE N D M AH M B EY K T AE P AH L P AY _"},
      {"SEN_few_people_know_the_way_through", "_ F Y UW P IY P AH L N OW DH AH W EY TH R UW _"},
      {"SEN_the_cook_chopped_onions_very_thin", "_ DH AH K UH K CH AA P T AH N Y AH N Z V EH R IY TH IH N _"},
      {"SEN_watch_how_the_white_geese_fly_south", "_ W AA CH HH AW DH AH W AY T G IY S F L AY S AW TH _"},
      {"SEN_the_young_nurse_spoke_in_a_low_voice", "_ DH AH Y AH NG N ER S S P OW K IH N AH L OW V OY S _"},
      {"SEN_an_hour_of_rain_filled_the_pool", "_ AE N AW ER AH V R EY N F IH L D DH AH P UW L _"},
      {"SEN_his_shoes_were_covered_in_mud", "_ HH IH Z SH UW Z W ER K AH V ER D IH N M AH D _"},
      {"SEN_put_the_blue_book_on_the_top_shelf", "_ P UH T DH AH B L UW B UH K AA N DH AH T AA P SH EH L F _"},
      {"SEN_the_choir_began_a_joyful_song", "_ DH AH K W AY ER B IH G AE N AH JH OY F AH L S AO NG _"},
      {"SEN_who_owns_the_yellow_umbrella", "_ HH UW OW N Z DH AH Y EH L OW AH M B R EH L AH _"},
      {"SEN_there_is_no_measure_for_pleasure", "_ DH EH R IH Z N OW M EH ZH ER F AO R P L EH ZH ER _"},
      {"SEN_smoke_rose_from_the_camp_fire", "_ S M OW K R OW Z F R AH M DH AH K AE M P F AY ER _"},
      {"SEN_a_fresh_breeze_came_off_the_lake", "_ AH F R EH SH B R IY Z K EY M AO F DH AH L EY K _"},
      {"SEN_open_the_window_before_you_leave", "_ OW P AH N DH AH W IH N D OW B IH F AO R Y UW L IY V _"},
      {"SEN_the_quick_thief_jumped_the_wall", "_ DH AH K W IH K TH IY F JH AH M P T DH AH W AO L _"},
      {"SEN_both_boys_enjoy_noisy_toys", "_ B OW TH B OY Z IH N JH OY N OY Z IY T OY Z _"},
      {"SEN_she_chose_a_cheap_silver_watch", "_ SH IY CH OW Z AH CH IY P S IH L V ER W AA CH _"},
      {"SEN_the_farmer_ploughed_his_field_at_dawn", "_ DH AH F AA R M ER P L AW D HH IH Z F IY L D AE T D AO N _"},
      {"SEN_a_huge_wave_broke_the_small_boat", "_ AH HH Y UW JH W EY V B R OW K DH AH S M AO L B OW T _"},
      {"SEN_why_would_a_wise_owl_wait_here", "_ W AY W UH D AH W AY Z AW L W EY T HH IY R _"},
      {"SEN_put_more_pepper_in_the_soup", "_ P UH T M AO R P EH P ER IH N DH AH S UW P _"},
      {"SEN_the_map_shows_every_village_road", "_ DH AH M AE P SH OW Z EH V R IY V IH L IH JH R OW D _"},
      {"SEN_three_thin_feathers_fell_from_above", "_ TH R IY TH IH N F EH DH ER Z F EH L F R AH M AH B AH V _"},
      {"SEN_we_must_book_a_room_by_monday", "_ W IY M AH S T B UH K AH R UW M B AY M AH N D EY _"},
      {"SEN_the_zoo_has_a_zebra_and_a_lizard", "_ DH AH Z UW HH AE Z AH Z IY B R AH AE N D AH L IH Z ER D _"},
      {"SEN_a_pair_of_gloves_lay_under_the_chair", "_ AH P EH R AH V G L AH V Z L EY AH N D ER DH AH CH EH R _"},
      {"SEN_the_long_path_led_to_a_wide_valley", "_ DH AH L AO NG P AE TH L EH D T UW AH W AY D V AE L IY _"},
      {"SEN_buy_fresh_bread_and_butter_for_me", "_ B AY F R EH SH B R EH D AE N D B AH T ER F AO R M IY _"},
      {"SEN_jane_wove_a_rough_wool_blanket", "_ JH EY N W OW V AH R AH F W UH L B L AE NG K AH T _"},
      {"SEN_the_old_clock_chimed_each_hour", "_ DH IY OW L D K L AA K CH AY M D IY CH AW ER _"},
      {"SEN_pack_my_bags_before_we_move", "_ P AE K M AY B AE G Z B IH F AO R W IY M UW V _"},
      {"SEN_the_shy_child_gave_a_soft_laugh", "_ DH AH SH AY CH AY L D G EY V AH S AO F T L AE F _"},
      {"SEN_you_should_use_a_sharper_knife", "_ Y UW SH UH D Y UW Z AH SH AA R P ER N AY F _"},
      {"SEN_heavy_snow_fell_over_the_town", "_ HH EH V IY S N OW F EH L OW V ER DH AH T AW N _"},
      {"SEN_the_ship_sailed_past_the_cape", "_ DH AH SH IH P S EY L D P AE S T DH AH K EY P _"},
      {"SEN_glue_the_sheet_to_the_dark_blue_background",
       "_ G L UW DH AH SH IY T T UW DH AH D AA R K B L UW B AE K G R AW N D _"},
  };
  return sentences;
}

double SentenceDuration(const Sentence& sentence) {
  return kSecondsPerPhoneme * static_cast<double>(VisemesOf(sentence).size());
}

std::array<float, kExpressionCount> SpeechWeights(const Sentence& sentence, double time_s) {
  const std::vector<const Viseme*> visemes = VisemesOf(sentence);
  std::array<double, kExpressionCount> sum = {};
  double total = 0;
  for (size_t i = 0; i < visemes.size(); ++i) {
    const double away = std::abs(time_s - (static_cast<double>(i) + 0.5) * kSecondsPerPhoneme) / kSecondsPerPhoneme;
    const double dominance = visemes[i]->dominance * std::exp(-1.8 * away);
    total += dominance;
    for (const auto& [name, weight] : visemes[i]->weights) {
      if (HasSides(name)) {
        for (const char* side : {"Left", "Right"}) {
          sum[static_cast<size_t>(ExpressionIndex(name + side))] += dominance * weight;
        }
      } else {
        sum[static_cast<size_t>(ExpressionIndex(name))] += dominance * weight;
      }
    }
  }
  std::array<float, kExpressionCount> weights = {};
  for (size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<float>(std::clamp(sum[i] / total, 0.0, 1.0));
  return weights;
}

}  // namespace likeness
