// The gains of every controller by name, with the limits that the optimiser and gain files keep to.

#include "flight/controllers/ibs_map.h"
#include "flight/controllers/ibs_observer.h"
#include "flight/controllers/indi.h"
#include "flight/controllers/pid.h"

namespace tunnelrig {
namespace {

void add_altitude(std::vector<NamedGain>& list, AltitudeGains& gains) {
  list.insert(list.end(), {{"posz_p", &gains.position_p, 0.3, 10},
                           {"velz_p", &gains.velocity_p, 1, 20},
                           {"accz_p", &gains.acceleration_p, 0.05, 2},
                           {"accz_i", &gains.acceleration_i, 0.1, 4}});
}

}  // namespace

std::vector<NamedGain> Ibs::gain_list() {
  return {{"k1_y", &gains_.k1[0], 0.01, 10}, {"k2_y", &gains_.k2[0], 0.2, 10},
          {"k3_y", &gains_.k3[0], 0.2, 10},  {"k1_z", &gains_.k1[1], 0.01, 10},
          {"k2_z", &gains_.k2[1], 0.2, 15},  {"k3_z", &gains_.k3[1], 0.2, 15}};
}

std::vector<NamedGain> Ibs::gain_list_with_lead() {
  std::vector<NamedGain> list = gain_list();
  list.push_back({"lead_s", &gains_.lead_s, 0.01, 0.6});
  return list;
}

std::vector<NamedGain> IbsMap::gain_list() { return ibs_.gain_list_with_lead(); }

std::vector<NamedGain> IbsObserver::gain_list() {
  return {{"k2_y", &gains_.k2[0], 0.2, 10},
          {"k3_y", &gains_.k3[0], 0.2, 10},
          {"observer_y", &gains_.bandwidth_rad_s[0], 0.2, 30},
          {"k2_z", &gains_.k2[1], 0.2, 15},
          {"k3_z", &gains_.k3[1], 0.2, 15},
          {"observer_z", &gains_.bandwidth_rad_s[1], 0.2, 30},
          {"lead_s", &gains_.lead_s, 0.01, 0.6}};
}

std::vector<NamedGain> Indi::gain_list() {
  return {{"position_y", &gains_.position[0], 0.3, 40}, {"velocity_y", &gains_.velocity[0], 0.5, 20},
          {"position_z", &gains_.position[1], 0.3, 80}, {"velocity_z", &gains_.velocity[1], 0.5, 20},
          {"filter_Hz", &gains_.filter_Hz, 0.2, 20},    {"lead_s", &gains_.lead_s, 0.01, 0.6}};
}

std::vector<NamedGain> PidCascade::gain_list() {
  std::vector<NamedGain> list;
  add_altitude(list, altitude_.gains());
  list.insert(list.end(), {{"posxy_p", &lateral_.position_p, 0.3, 10},
                           {"velxy_p", &lateral_.velocity_p, 0.5, 15},
                           {"velxy_i", &lateral_.velocity_i, 0.05, 10},
                           {"velxy_d", &lateral_.velocity_d, 0.01, 3}});
  return list;
}

std::vector<NamedGain> PidSingle::gain_list() {
  std::vector<NamedGain> list;
  add_altitude(list, altitude_.gains());
  list.insert(list.end(),
              {{"p", &lateral_.p, 0.02, 4}, {"i", &lateral_.i, 0.002, 4}, {"d", &lateral_.d, 0.02, 2}});
  return list;
}

}  // namespace tunnelrig
